"""Proofs for all times, and an independent checker of them."""
