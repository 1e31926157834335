"""The extremes of states and inputs by another way: interpolation in each cell, and the roots of derivatives.

Slow and simple. Signals are evaluated in rational numbers by their definition. Between two shifted breakpoints a
quantity is a polynomial; as many of its values as it needs determine it. Roots are isolated by FLINT, in balls.
"""

from collections.abc import Callable
from fractions import Fraction
from functools import reduce
from itertools import pairwise

from flint import arb, arb_poly, ctx, fmpq, fmpq_poly

from trackably.systems.pieces import PolynomialPieces
from trackably.systems.trajectories import Functional

PRECISION = 300


def value_of(signal: PolynomialPieces, t: Fraction, before: bool = False) -> Fraction:
    """z(t), or its limit from before."""
    ends = [Fraction(end) for end in signal.breakpoints.tolist()]
    if signal.beyond == "period":
        period = ends[-1] - ends[0]
        while t >= ends[-1] or t < ends[0]:
            t -= ((t - ends[0]) // period) * period
        if before and t == ends[0]:
            t = ends[-1]
    if signal.beyond == "rest":
        t = min(max(t, ends[0]), ends[-1])
    inside = [i for i, end in enumerate(ends[:-1]) if end < t or (end == t and not before)]
    i = inside[-1] if inside else 0
    return sum((Fraction(c) * (t - ends[i]) ** j for j, c in enumerate(signal.coefficients[i].tolist())), Fraction(0))


def quantity_at(functional: Functional, signals: tuple[PolynomialPieces, ...], t: Fraction) -> Fraction:
    """offset + Σ w z(t + j T)."""
    step = Fraction(functional.sampling_time)
    total = functional.offset
    for signal, weights in zip(signals, functional.weights, strict=True):
        for j, w in enumerate(weights):
            total += w * value_of(signal, t + j * step) if w else 0
    return total


def breaks(
    functional: Functional, signals: tuple[PolynomialPieces, ...], start: Fraction, end: Fraction
) -> list[Fraction]:
    """All times at which the polynomial may be another, with start and end."""
    step, found = Fraction(functional.sampling_time), {start, end}
    for signal, weights in zip(signals, functional.weights, strict=True):
        ends = [Fraction(t) for t in signal.breakpoints.tolist()]
        turns = range(-3, 4) if signal.beyond == "period" else range(1)
        for turn in turns:
            for j in range(len(weights)):
                found |= {t + turn * (ends[-1] - ends[0]) - j * step for t in ends}
    return sorted(t for t in found if start <= t <= end)


def extremes(
    functional: Functional, signals: tuple[PolynomialPieces, ...], start: Fraction, end: Fraction
) -> tuple[arb, arb]:
    """Balls around the least and the largest value (or limit) from start to end [s]."""
    degree = max(signal.degree for signal in signals)
    with ctx.workprec(PRECISION):
        balls = [arb(exact(quantity_at(functional, signals, end)))]
        for a, b in pairwise(breaks(functional, signals, start, end)):
            nodes = [a + (b - a) * Fraction(i + 1, degree + 2) for i in range(degree + 1)]
            polynomial = interpolated(nodes, lambda t: quantity_at(functional, signals, t))
            balls += candidates(polynomial, a, b)
        return reduce(arb.min, balls), reduce(arb.max, balls)


def candidates(polynomial: fmpq_poly, a: Fraction, b: Fraction) -> list[arb]:
    """The values at a and b, and where the derivative vanishes between them."""
    slope, first, last = polynomial.derivative(), arb(exact(a)), arb(exact(b))
    roots = slope.complex_roots() if slope.degree() >= 1 else ()
    real = (arb(root.real) for root, _ in roots if not abs(root.imag) > 0)
    return [arb_poly(polynomial)(t) for t in (first, last, *(t for t in real if not (t < first or t > last)))]


def interpolated(nodes: list[Fraction], values: Callable[[Fraction], Fraction]) -> fmpq_poly:
    """The polynomial through the values at the nodes, by Newton's divided differences."""
    table = [values(t) for t in nodes]
    for level in range(1, len(nodes)):
        for i in range(len(nodes) - 1, level - 1, -1):
            table[i] = (table[i] - table[i - 1]) / (nodes[i] - nodes[i - level])
    found = fmpq_poly([exact(table[-1])])
    for t, difference in zip(reversed(nodes[:-1]), reversed(table[:-1]), strict=True):
        found = found * fmpq_poly([-exact(t), 1]) + exact(difference)
    return found


def exact(number: Fraction) -> fmpq:
    return fmpq(number.numerator, number.denominator)
