"""The largest files that are read, so that every check ends: the theorem names these numbers.

They are far beyond what a proof needs; a check that takes long all the same can be given a time.
"""

BYTES = 32_000_000
"""Of a file."""

SIGNALS = COORDINATES = SHIFTS = 100
"""Signals; states, and inputs; shifts j T of a signal that one state or input depends on."""

ROWS = 10_000
"""Rows of a set, and attainable rows."""

CENTRES = BOXES = INSTANTS = 500_000
"""Centres of a signal; boxes of a bound; instants that are checked one by one."""

COEFFICIENTS = 100
"""Of a polynomial piece."""

POWERS = 10_000
"""Of A + B K, for a disturbed system."""

TERMS = 64
"""Of a Taylor polynomial."""

DIGITS = 20_000
"""Of a rational number."""

KERNELS, KERNEL_DEPTH = 100, 40
"""Kernels of which a signal's kernel is made, and how deep their sums and products are nested."""

PARTS, DEPTH = 30_000, 100
"""Operations, names and numbers of a formula, and how deep it is nested."""
