"""Systems with their sets, and references: states and inputs as functions of the learned signals."""
