"""Gaussian processes over time: kernels, posterior, likelihood. Knows time series; knows no control."""
