"""Figures, by what they show: references, Algorithm 1, predictions of scalar systems, loops."""
