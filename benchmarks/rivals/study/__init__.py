"""Thousands of drawn problems, each rival on the same draws: how often they fail, and by how much they err."""
