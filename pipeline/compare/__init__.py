"""Compare two sets of artifacts: what moved, by how much and where, and which of the paper's claims still hold."""
