"""Ball arithmetic (python-flint): the working precision."""

from functools import partial

from flint import ctx

BITS = 160
"""Terms of kernel sums cancel: even with weights of 1e20 more digits remain than a float64 has."""

ball_arithmetic = partial(ctx.workprec, BITS)
"""Set this precision in a block, and restore that before."""
