"""Proofs for all times: proposed in plain float64, and handed out only if the checker accepts them."""
