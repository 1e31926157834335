"""What a reference is made of: signals that can be evaluated here, and enclosed by a proof."""

from trackably.gp.signal import KernelSum
from trackably.systems.signals.pieces import PolynomialPieces

Signal = KernelSum | PolynomialPieces
"""A sum of kernels, as samples are learned, or polynomial pieces, as splines and planners give them."""
