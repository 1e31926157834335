"""Learn a reference from samples and prove that a plant can follow it: checks of the input, prior, search, result."""
