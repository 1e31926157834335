"""Polynomials that are nowhere negative on [−1, 1]."""

from itertools import pairwise
from math import comb

from trackable.checker.arithmetic.intervals import ZERO, Real, at_most, total

_MOST_CUTS = 500


def is_positive(a: list[Real]) -> bool:
    """Return whether Σ a_k x^k ≥ 0 on [−1, 1]: certain where its Bernstein coefficients in y = (x + 1)/2 are ≥ 0."""
    n = len(a) - 1
    p = [a[n]]
    for coefficient in reversed(a[:-1]):  # Horner: p ← (2y − 1) p + a_k
        p = [2 * x - y for x, y in zip([ZERO, *p], [*p, ZERO], strict=True)]
        p[0] += coefficient
    waiting = [[total(p[j] * comb(k, j) / comb(n, j) for j in range(k + 1)) for k in range(n + 1)]]
    for _ in range(_MOST_CUTS):
        if not waiting:
            return True
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
