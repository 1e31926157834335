"""References with their proofs: what they give to a controller, whether they were learned or given."""
