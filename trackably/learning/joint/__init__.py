"""Learn function and hyperparameters together: minimise J = l + D, with l(θ) = −2 ln p and the cost D of the bounds."""
