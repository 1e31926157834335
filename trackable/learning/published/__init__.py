"""Algorithm 1 and the periodic program as the paper has them."""
