"""Proofs for all times: proposed here in plain float64, and handed out only as the checker accepts them."""
