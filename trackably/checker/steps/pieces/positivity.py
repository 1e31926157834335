"""Polynomials with whole coefficients that are nowhere negative on [0, 1]."""

from collections.abc import Sequence

from trackably.checker.watch import tick

_MOST_CUTS = 2000


def is_nowhere_negative(a: Sequence[int]) -> bool:
    """Return whether Σ a_k x^k ≥ 0 for all x ∈ [0, 1].

    With x = y/(1 + y), (1 + y)ⁿ p(x) = Σ a_k y^k (1 + y)^(n − k): where all coefficients of this polynomial in y ≥ 0
    are ≥ 0, p is nowhere negative. Where some are not, [0, 1] is halved; a negative value at an end refutes it.
    """
    waiting = [list(a)]
    for _ in range(_MOST_CUTS):
        if not waiting:
            return True
        tick()
        p = waiting.pop()
        if p[0] < 0 or sum(p) < 0:
            return False
        if all(c >= 0 for c in _moved(p[::-1])):
            continue
        n = len(p) - 1
        half = [c << (n - k) for k, c in enumerate(p)]  # 2ⁿ p(x/2)
        waiting += [half, _moved(half)]
    return False


def _moved(p: Sequence[int]) -> list[int]:
    """Return the coefficients of p(x + 1)."""
    found = list(p)
    for i in range(len(found) - 1):
        for k in range(len(found) - 2, i - 1, -1):
            found[k] += found[k + 1]
    return found
