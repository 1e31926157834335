"""A first pass over boxes of time, in float64 intervals with outward rounding; needs NumPy."""
