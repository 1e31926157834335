"""Redundant inputs: where u(t) keeps its bounds, some input in the input set pushes the system as u(t) does."""

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations
from math import comb
from typing import Any

from trackable.checker.intervals import exact_sum

_MOST = 10_000


def check_input_set(certificate: Any) -> str | None:
    """Every circuit's inequality follows from a bound; without an input set there is nothing to check."""
    if "input_set" not in certificate:
        return None
    m, rows = len(certificate["system"]["inputs"]), certificate["input_set"]
    if any(len(side["row"]) != m or not side["lower"] <= side["upper"] for side in rows):
        return "input_set: every row needs a number for each input, and lower ≤ upper"
    idle = _null_space([[Fraction(b) for b in row] for row in certificate["system"]["B"]], m)
    if sum(comb(len(rows), size) for size in range(1, len(idle) + 2)) > _MOST:
        return "input_set: there are too many rows for so many redundant inputs"
    pushes = [[exact_sum(Fraction(r) * z for r, z in zip(side["row"], v, strict=True)) for v in idle] for side in rows]
    for circuit in _circuits(pushes, len(idle)):
        row = [exact_sum(factor * Fraction(rows[i]["row"][j]) for i, factor in circuit) for j in range(m)]
        low, high = (
            exact_sum(factor * Fraction(rows[i][end if factor > 0 else other]) for i, factor in circuit)
            for end, other in (("lower", "upper"), ("upper", "lower"))
        )
        names = ", ".join(str(i) for i, _ in circuit)
        if not any(row) and not low <= 0 <= high:
            return f"input_set: no input keeps its rows {names} together"
        if any(row) and not any(_implies(bound, row, low, high) for bound in certificate["bounds"]):
            return f"input_set: no bound keeps what its rows {names} leave of the inputs together"
    return None


def _circuits(pushes: list[list[Fraction]], dimension: int) -> Iterator[list[tuple[int, Fraction]]]:
    """Rows with factors: whatever some rows have as their only relation, which those with least support are."""
    for size in range(1, dimension + 2):
        for support in combinations(range(len(pushes)), size):
            relations = _null_space([[pushes[i][k] for i in support] for k in range(dimension)], size)
            if len(relations) == 1 and all(relations[0]):
                yield list(zip(support, relations[0], strict=True))


def _implies(bound: Any, row: list[Fraction], low: Fraction, high: Fraction) -> bool:
    """Whether low ≤ row · u ≤ high wherever the bound is kept, its row being a multiple of this one."""
    if bound["of"] != "input":
        return False
    first = next(j for j, r in enumerate(row) if r)
    multiple = bound["row"][first] / row[first]
    if not multiple or any(b != multiple * r for b, r in zip(bound["row"], row, strict=True)):
        return False
    kept = sorted(Fraction(bound[end]) / multiple for end in ("lower", "upper"))
    return bool(low <= kept[0] and kept[1] <= high)


def _null_space(matrix: list[list[Fraction]], n: int) -> list[list[Fraction]]:
    """A basis of all v of n numbers with M v = 0, by elimination."""
    rows = [list(row) for row in matrix]
    pivots: list[int] = []
    for j in range(n):
        at = len(pivots)
        found = next((i for i in range(at, len(rows)) if rows[i][j]), None)
        if found is None:
            continue
        rows[at], rows[found] = rows[found], rows[at]
        rows[at] = [r / rows[at][j] for r in rows[at]]
        for i in range(len(rows)):
            if i != at:
                rows[i] = [r - rows[i][j] * p for r, p in zip(rows[i], rows[at], strict=True)]
        pivots.append(j)
    basis = []
    for free in (j for j in range(n) if j not in pivots):
        v = [Fraction(int(j == free)) for j in range(n)]
        for i, pivot in enumerate(pivots):
            v[pivot] = -rows[i][free]
        basis.append(v)
    return basis
