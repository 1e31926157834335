"""Ball arithmetic (python-flint): the working precision, and the way back to float64 with a known direction."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

from flint import arb, ctx

BITS = 160
"""Sums of kernels cancel: weights of 1e20 would still leave more digits here than a float64 has."""


@contextmanager
def ball_arithmetic(terms: int = 1) -> Iterator[None]:
    """Balls of `BITS` bits and power series of `terms` terms inside; what was set before, afterwards."""
    before = ctx.prec, ctx.cap
    ctx.prec, ctx.cap = BITS, terms
    try:
        yield
    finally:
        ctx.prec, ctx.cap = before


def float_above(ball: arb) -> float:
    """A float64 that is certainly no smaller than any number of the ball; infinite where there is none."""
    value = float(ball.upper()) if ball.is_finite() else math.inf
    return math.nextafter(value, math.inf)


def float_below(ball: arb) -> float:
    """A float64 that is certainly no larger than any number of the ball."""
    return -float_above(-ball)
