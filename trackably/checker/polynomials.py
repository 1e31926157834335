"""Shift and scale arguments of polynomials, and decide in integers whether polynomials stay between two numbers."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from math import comb, lcm
from typing import TypeVar

from trackably.checker.intervals import in_whole_numbers
from trackably.checker.watch import tick

Number = TypeVar("Number", int, Fraction)

_MOST_CUTS = 2000


def stays_between(p: Sequence[Fraction | int], low: Fraction | int, high: Fraction | int) -> bool:
    """Return whether low ≤ Σ p_k x^k ≤ high for all x ∈ [0, 1].

    False may also mean that the decision takes too long.
    """
    _, ((bottom, first, top, *others),) = in_whole_numbers([[low, p[0], high, *p[1:]]])
    return is_nowhere_negative([first - bottom, *others]) and is_nowhere_negative([top - first, *(-c for c in others)])


def is_nowhere_negative(a: list[int]) -> bool:
    """Return whether Σ a_k x^k ≥ 0 for all x ∈ [0, 1].

    With Bernstein coefficients b_k, the sum is Σ b_k C(n, k) x^k (1 − x)^(n − k). If all b_k are ≥ 0, it is nowhere
    negative. b_0 and b_n are its values at 0 and 1: a negative one refutes the claim. Otherwise [0, 1] is halved.

    With x = y/(1 + y), the b_k C(n, k) are the coefficients in y of (1 + y)ⁿ Σ a_k x^k. All b_k are multiplied by the
    same positive number, which makes them integers.
    """
    if a[0] >= sum(map(abs, a[1:])):
        return True
    counts = [comb(len(a) - 1, k) for k in range(len(a))]
    unit = lcm(*counts)
    waiting = [[c * (unit // count) for c, count in zip(shift(a[::-1], 1)[::-1], counts, strict=True)]]
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
