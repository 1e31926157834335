"""Polynomials that are nowhere negative on [−1, 1]."""

from functools import cache
from itertools import pairwise
from math import comb

from trackably.checker.arithmetic.intervals import ZERO, Real, at_most, exactly, total
from trackably.checker.watch import tick

_MOST_CUTS = 500
_TWO = exactly(2)


def is_positive(a: list[Real]) -> bool:
    """Return whether Σ a_k x^k ≥ 0 on [−1, 1]: certain where its Bernstein coefficients in y = (x + 1)/2 are ≥ 0."""
    n = len(a) - 1
    p = [a[n]]
    for coefficient in reversed(a[:-1]):  # Horner: p ← (2y − 1) p + a_k
        p = [_TWO * x - y for x, y in zip([ZERO, *p], [*p, ZERO], strict=True)]
        p[0] += coefficient
    waiting = [[total(p[j] * part for j, part in enumerate(row)) for row in _binomials(n)]]
    for _ in range(_MOST_CUTS):
        if not waiting:
            return True
        tick()
        b = waiting.pop()
        if not (at_most(0, b[0]) and at_most(0, b[-1])):  # the outer coefficients are values of the polynomial
            return False
        if all(at_most(0, x) for x in b):
            continue
        left: list[Real] = []
        right: list[Real] = []
        while b:  # de Casteljau: the coefficients of both halves
            left, right = [*left, b[0]], [b[-1], *right]
            b = [(x + y) / 2 for x, y in pairwise(b)]
        waiting += [left, right]
    return False


@cache
def _binomials(n: int) -> list[list[Real]]:
    """Return C(k, j)/C(n, j) for j ≤ k ≤ n: the Bernstein coefficient k of y^j in degree n."""
    return [[exactly(comb(k, j)) / exactly(comb(n, j)) for j in range(k + 1)] for k in range(n + 1)]
