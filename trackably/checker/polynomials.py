"""Shift and scale arguments of polynomials, and decide in integers whether polynomials stay between two numbers."""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from itertools import accumulate, pairwise
from math import comb, lcm
from typing import TypeVar

from trackably.checker.watch import short, tick

Number = TypeVar("Number", int, Fraction)

_MOST_CUTS = 2000


def stays_between(a: Sequence[int], low: int, high: int) -> bool:
    """Return whether low ≤ Σ a_k x^k ≤ high for all x ∈ [0, 1].

    False may also mean that the decision takes too long.
    """
    beyond = sum(map(abs, a[1:]))
    if low + beyond <= a[0] <= high - beyond:
        return True
    b, unit = bernstein_form(a)
    return all(_stays_positive([sign * (c - unit * end) for c in b]) for sign, end in ((1, low), (-1, high)))


def is_nowhere_negative(a: Sequence[int]) -> bool:
    """Return whether Σ a_k x^k ≥ 0 for all x ∈ [0, 1]; False may also mean that the decision takes too long."""
    return a[0] >= sum(map(abs, a[1:])) or _stays_positive(bernstein_form(a)[0])


def bernstein_form(a: Sequence[int]) -> tuple[list[int], int]:
    """Return the Bernstein coefficients of Σ a_k x^k on [0, 1], times a positive number that makes them whole.

    This number comes second. x^k has the Bernstein coefficients b_i = C(i, k)/C(n, k). So the k-th differences of
    Σ a_k x^k begin with a_k/C(n, k), and sums of differences give the b_i.
    """
    (unit, factors), found = _factors(len(a)), list[int]()
    for c, factor in zip(reversed(a), factors, strict=True):
        found = [*accumulate(found, initial=c * factor)]
    return found, unit


@cache
def _factors(count: int) -> tuple[int, list[int]]:
    """Return the least common multiple of all C(n, k), n = count − 1, and its quotients by them."""
    counts = [comb(count - 1, k) for k in range(count)]
    unit = lcm(*counts)
    return unit, [unit // c for c in counts]  # the same from both sides, as C(n, k) = C(n, n − k)


def _stays_positive(b: list[int]) -> bool:
    """Return whether Σ b_k C(n, k) x^k (1 − x)^(n − k) ≥ 0 for all x ∈ [0, 1].

    If all b_k are ≥ 0, the sum is nowhere negative. b_0 and b_n are its values at 0 and 1: a negative one refutes the
    claim. Otherwise [0, 1] is halved.
    """
    waiting = [b]
    for _ in range(_MOST_CUTS):
        if not waiting:
            return True
        tick()
        b = waiting.pop()
        if b[0] < 0 or b[-1] < 0:
            return False
        if min(b) < 0:
            waiting += _halves(b)
    return False


def _halves(b: list[int]) -> tuple[list[int], list[int]]:
    """Return 2ⁿ times the Bernstein coefficients on [0, ½] and on [½, 1], by de Casteljau's algorithm."""
    left, right = list[int](), list[int]()
    for k in reversed(range(len(b))):
        left.append(b[0] << k)
        right.append(b[-1] << k)
        b = [low + high for low, high in pairwise(b)]
    return left, right[::-1]


def value_of_polynomial(p: Sequence[float | Fraction], x: Fraction) -> Fraction:
    """Return Σ p_k x^k, by Horner's rule."""
    found = Fraction(0)
    for c in reversed(p):
        found = short(found * x + Fraction(c))
    return found


def shift(p: Sequence[Number], by: Number) -> list[Number]:
    """Return the coefficients of p(x + by)."""
    found = list(p)
    for i in range(len(found) - 1):
        for k in range(len(found) - 2, i - 1, -1):
            found[k] += by * found[k + 1]
    return found


def compose(p: Sequence[Number], start: Number, width: Number) -> list[Number]:
    """Return the coefficients in x of p(start + width x)."""
    return [c * width**k for k, c in enumerate(shift(p, start))]
