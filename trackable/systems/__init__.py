"""Systems, their sets, and a reference's own states and inputs as functions of the learned signal."""
