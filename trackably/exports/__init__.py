"""References with their proofs, as others take them: Python's conventions, and the formats of other tools."""
