"""The largest files that are read, and what a check may take: the theorem names these numbers.

They are far beyond what a proof needs. Files that exceed them are refused before any work; a check that exceeds those
of the second part leaves its file Undecided. A check that takes long all the same can be given a time.
"""

BYTES = 32_000_000
"""Of a file."""

TEXTS = 500_000
"""Characters of all texts of a file together: rational numbers, names, and the operations of formulas."""

SIGNALS = COORDINATES = SHIFTS = 100
"""Signals; states, and inputs; shifts j T of a signal that one state or input depends on."""

WEIGHTS = 1_000_000
"""Weights of shifted signals, in all bounds together, or in all names of a flat form together."""

ROWS = 10_000
"""Rows of a set, and attainable rows."""

CENTRES = BOXES = INSTANTS = CELLS = 500_000
"""Centres of a signal; boxes of a bound; instants that are checked one by one; breakpoints of a bound in a claim."""

COEFFICIENTS = 100
"""Of a polynomial piece."""

POWERS = 10_000
"""Of A + B K, for a disturbed system."""

TERMS = 64
"""Of a Taylor polynomial."""

DIGITS = 4_000
"""Of a rational number, in characters; Python reads and writes no more than 4,300 at once."""

KERNELS, KERNEL_DEPTH = 100, 40
"""Kernels of which a signal's kernel is made, and how deep their sums and products are nested."""

PARTS, DEPTH = 30_000, 100
"""Operations, names and numbers of a system's formulas together, and how deep each is nested."""

# While a file is checked:

MEMORY = 700_000_000
"""Bytes beyond those that the process has held before."""

BITS, BITS_TOGETHER = 500_000, 1_000_000_000
"""Of a rational number; of whole numbers that are held together."""
