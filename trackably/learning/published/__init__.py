"""Algorithm 1 and the periodic programs as the paper has them."""
