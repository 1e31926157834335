"""Learning hyperparameters under the constraint that the posterior mean can be tracked."""
