"""The function and its hyperparameters, learned together: J(θ) = l(θ) + D(θ), D being what the bounds cost."""
