"""Disturbance sets, feedback, and bounds drawn in by what errors under disturbances may take of them."""
