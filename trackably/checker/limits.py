"""The largest files that are read, and the largest effort of a check; the theorem names these numbers.

The limits are far beyond the needs of a proof. A file that exceeds one of the limits from `BYTES` to `DEPTH`, except
`CELLS`, is refused before it is checked. A check that exceeds `CELLS`, `MEMORY`, `BITS` or `BITS_TOGETHER` is
Undecided, and so is one that exceeds the time that it is given.
"""

BYTES = 32_000_000
"""Most bytes of a file."""

TEXTS = 500_000
"""Most characters of all texts of a file together: rational numbers, names, and the operations of formulas."""

SIGNALS = COORDINATES = SHIFTS = 100
"""Most signals; most states, and most inputs; most shifts j T of a signal that one state or input depends on."""

WEIGHTS = 1_000_000
"""Most weights of shifted signals, in all bounds together, or in all names of a flat form together."""

ROWS = 10_000
"""Most rows of a set, and most attainable rows."""

CENTRES = BOXES = INSTANTS = CELLS = 500_000
"""Most centres of a signal, boxes of a bound, instants checked one by one, and breakpoints in one bounded quantity."""

LATEST_STEP = 2**53
"""Largest number of a step that a table or a counterexample names; also the number of the earliest step of a table."""

COEFFICIENTS = 100
"""Most coefficients of a polynomial piece."""

POWERS = 10_000
"""Most powers of A + B K in the proof for a disturbed system: the largest N, and the largest s, of `disturbances`."""

TERMS = 64
"""Most terms of a Taylor polynomial."""

DIGITS = 4_000
"""Most characters of a rational number; Python reads and writes integers of at most 4,300 digits."""

KERNELS, KERNEL_DEPTH = 100, 40
"""Most kernels in the kernel of a signal, and largest depth of its nested sums and products."""

PARTS, DEPTH = 30_000, 100
"""Most operations, names and numbers in all formulas of a system, and largest depth of nesting of a formula."""

MAY_BE_EMPTY = True
"""Says of a list with a largest length that it may be empty; other lists may not."""

# Limits of the effort of a check.

MEMORY = 700_000_000
"""Most bytes that a check may use in addition to those that the process held before."""

BITS, BITS_TOGETHER = 500_000, 1_000_000_000
"""Most bits of a rational number, and most bits of all integers that are held at once."""
