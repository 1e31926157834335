"""Factorisations of the covariance matrix K + V: dense, band, Markov, Fourier, low rank; and their building blocks."""
