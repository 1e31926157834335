"""References as C headers: coefficients, and the operations that certificates bound the rounding of."""
