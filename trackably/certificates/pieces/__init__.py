"""Proofs about polynomial pieces, in rational arithmetic: extremes are found, not only bounds of them."""
