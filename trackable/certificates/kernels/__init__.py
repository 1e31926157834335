"""What proofs know of kernels: one class a family, in a file of its own, and one table."""
