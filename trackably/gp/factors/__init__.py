"""Factorisations of the covariance matrix K + V: dense, quasiseparable, Fourier."""
