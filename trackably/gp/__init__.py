"""Gaussian processes over time: kernels, posterior, likelihood. Nothing here depends on control."""
