"""Move polynomials, and decide in integer arithmetic whether they stay between two numbers."""

from collections.abc import Sequence
from fractions import Fraction
from typing import TypeVar

from trackably.checker.intervals import common_denominator
from trackably.checker.watch import tick

Number = TypeVar("Number", int, Fraction)

_MOST_CUTS = 2000


def stays_between(p: Sequence[Fraction | int], low: Fraction | int, high: Fraction | int) -> bool:
    """Return whether low ≤ Σ p_k x^k ≤ high for all x ∈ [0, 1].

    False may also mean that the decision takes too long.
    """
    unit = common_denominator([*p, low, high])
    bottom, first, top, *others = (int(c * unit) for c in (low, p[0], high, *p[1:]))
    return is_nowhere_negative([first - bottom, *others]) and is_nowhere_negative([top - first, *(-c for c in others)])


def is_nowhere_negative(a: list[int]) -> bool:
    """Return whether Σ a_k x^k ≥ 0 for all x ∈ [0, 1].

    With x = y/(1 + y), (1 + y)ⁿ p(x) = Σ a_k y^k (1 + y)^(n − k). If all coefficients of this polynomial in y ≥ 0 are ≥
    0, p is nowhere negative. Otherwise [0, 1] is halved; a negative value at an end refutes the claim.
    """
    waiting = [a]
    for _ in range(_MOST_CUTS):
        if not waiting:
            return True
        tick()
        p = waiting.pop()
        if p[0] < 0 or sum(p) < 0:
            return False
        if p[0] >= sum(map(abs, p[1:])) or all(c >= 0 for c in shift(p[::-1], 1)):
            continue
        n = len(p) - 1
        half = [c << (n - k) for k, c in enumerate(p)]  # 2ⁿ p(x/2)
        waiting += [half, shift(half, 1)]
    return False


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
