"""Learn hyperparameters, or a function with its hyperparameters, so that bounds of a plant are kept at all times."""
