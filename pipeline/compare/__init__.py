"""Compare two sets of results: which values differ, by how much and where, and which of the paper's claims hold."""
