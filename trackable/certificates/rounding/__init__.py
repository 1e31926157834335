"""How far float64 evaluation can be from the real numbers that a certificate speaks about."""
