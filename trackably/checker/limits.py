"""The largest files that are read, and the largest effort of a check; the theorem names these numbers.

They are far beyond the needs of a proof. Files that exceed them are refused before any work. A check that exceeds those
at the end of the list is Undecided. The time of a check can be limited in addition.
"""

BYTES = 32_000_000
"""Size of a file."""

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
"""Coefficients of a polynomial piece."""

POWERS = 10_000
"""Powers of A + B K, for a disturbed system."""

TERMS = 64
"""Terms of a Taylor polynomial."""

DIGITS = 4_000
"""Characters of a rational number; Python reads and writes no more than 4,300 at once."""

KERNELS, KERNEL_DEPTH = 100, 40
"""Number of kernels in the kernel of a signal, and depth of nested sums and products."""

PARTS, DEPTH = 30_000, 100
"""Operations, names and numbers of all formulas of a system together, and depth of nesting of each."""

# While a file is checked:

MEMORY = 700_000_000
"""Bytes in addition to those that the process held before the check."""

BITS, BITS_TOGETHER = 500_000, 1_000_000_000
"""Bits of a rational number; and of all integers that are held together."""
