"""Ball arithmetic (python-flint): the working precision, and conversion to float64 with directed rounding."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from flint import arb, ctx

BITS = 160
"""Terms of kernel sums cancel: even with weights of 1e20 more digits remain than a float64 has."""


@contextmanager
def ball_arithmetic(terms: int = 1) -> Iterator[None]:
    """Set the precision (`BITS`) and the length of power series inside the block; restore both afterwards."""
    before = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = BITS, terms
    try:
        yield
    finally:
        ctx.prec, ctx.cap = before


def float_above(ball: arb) -> float:
    """Return a float64 that is certainly no smaller than any number of the ball; infinity if the ball is not finite."""
    value = float(ball.upper()) if ball.is_finite() else math.inf
    return math.nextafter(value, math.inf)


def float_below(ball: arb) -> float:
    """Return a float64 that is certainly no larger than any number of the ball."""
    return -float_above(-ball)
