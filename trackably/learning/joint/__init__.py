"""Learn function and hyperparameters together: minimise J(θ) = l(θ) + D(θ), where D is the cost of the bounds."""
