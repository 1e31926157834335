"""What the paper published, and what is simulated in its place: ground truths, named models and recordings."""
