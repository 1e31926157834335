"""A first pass in float64 with outward rounding: many boxes and many centres at once, as arrays."""
