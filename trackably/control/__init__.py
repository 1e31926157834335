"""Model predictive control that tracks a reference, where trackability matters."""
