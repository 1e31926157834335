"""Bounds of the error of evaluating polynomial pieces in float64, by Horner's rule (`PolynomialPieces.summed`)."""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from flint import arb

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.systems.signals.pieces import PolynomialPieces

_LARGEST, _SMALLEST, _LARGEST_POWER, _HIGHEST = 1e30, 1e-30, 1e100, 50


def pieces_error(signal: PolynomialPieces, latest: arb, ahead: arb) -> tuple[arb, arb]:
    """Bound |float64 − exact| and |z| of a signal at t + s, up to `latest` [s], with shifts s up to `ahead` [s].

    k T, s = j T, t + s, the phase of a period and the time since the breakpoint are rounded: all of them together move
    t + s by 10 u times the sizes of the times at most. That changes z by its slope, and by a jump where it leads across
    a breakpoint. Horner's rule adds 2 n u times the sum of the absolute terms.
    """
    value, slope, jump = _sizes(signal)
    u, n = arb(2) ** -53, signal.degree
    farthest = arb(float(np.max(np.abs(signal.breakpoints))))
    if signal.beyond == "period":
        farthest = latest + 2 * farthest + signal.period
    moved = 10 * u * (farthest + ahead)
    shortest = float(np.min(np.diff(signal.breakpoints)))
    if not 500 * (n + 1) * moved < shortest:  # rounding could lead far beyond a piece
        return arb.pos_inf(), value
    return (2 * n + 6) * u * value + moved * slope + jump, value


@lru_cache(maxsize=64)
def _sizes(signal: PolynomialPieces) -> tuple[arb, arb, arb]:
    """Over-estimate |z| and |ż| by the sums of absolute terms, and bound the jumps between pieces."""
    with ball_arithmetic():
        value, slope, firsts, lasts = arb(0), arb(0), list[arb](), list[arb]()
        for (start, end), row in zip(pairwise(signal.breakpoints.tolist()), signal.coefficients.tolist(), strict=True):
            h = arb(end) - arb(start)
            terms = [arb(c) * h**j for j, c in enumerate(row)]
            value = value.max(sum(map(abs, terms), arb(0)))
            slope = slope.max(sum((j * abs(term) for j, term in enumerate(terms)), arb(0)) / h)
            firsts.append(terms[0])
            lasts.append(sum(terms, arb(0)))
        jump, met = arb(0), [*firsts[1:], firsts[0] if signal.beyond == "period" else lasts[-1]]
        for last, first in zip(lasts, met, strict=True):
            jump = jump.max(abs(last - first))
        return value.upper(), slope.upper(), jump.upper()


def are_sane(signal: PolynomialPieces) -> bool:
    """Whether all numbers have sizes for which the analysis above holds: nothing overflows."""
    numbers, lengths = np.abs([*signal.breakpoints, *signal.coefficients.ravel()]), np.diff(signal.breakpoints)
    longest = float(np.max(lengths))
    return bool(
        np.all(numbers <= _LARGEST)
        and np.min(lengths) >= _SMALLEST
        and signal.degree <= _HIGHEST
        and max(longest, 1.0) ** signal.degree <= _LARGEST_POWER
    )
