"""Factorisations of the covariance matrix K + V: dense, band, Markov, Fourier, low rank; and what they are made of."""
