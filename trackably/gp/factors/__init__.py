"""Factorisations of the covariance matrix K + V: dense, band, low rank, Toeplitz; and what they are made of."""
