"""Step 6 of the proof, redundant inputs: if u(t) keeps the attainable rows, some input in U acts as u(t) does."""

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations
from math import comb

from trackable.checker.arithmetic.intervals import exact_sum
from trackable.checker.certificate import Certificate, LinearSystem, Row

_MOST = 10_000


def check_input_set(certificate: Certificate) -> str | None:
    """Verify that each circuit's inequality follows from an attainable row, if there are any such rows."""
    if certificate.attainable is None or not isinstance(certificate.system, LinearSystem):
        return None
    return why_not_attainable(certificate.system, certificate.input_set.rows, certificate.attainable)


def why_not_attainable(system: LinearSystem, rows: tuple[Row, ...], attainable: tuple[Row, ...]) -> str | None:
    """Return why some u that keeps the attainable rows may have no u + v in U with B v = 0; None if all have one."""
    m = len(system.inputs)
    if any(len(side.row) != m or not side.lower <= side.upper for side in rows):
        return "input_set: every row needs a number for each input, and lower ≤ upper"
    idle = _null_space([[Fraction(b) for b in row] for row in system.B], m)
    if sum(comb(len(rows), size) for size in range(1, len(idle) + 2)) > _MOST:
        return "input_set: there are too many rows for so many redundant inputs"
    moved = [[exact_sum(r * z for r, z in zip(side.row, v, strict=True)) for v in idle] for side in rows]
    for circuit in _circuits(moved, len(idle)):
        row = [exact_sum(factor * rows[i].row[j] for i, factor in circuit) for j in range(m)]
        low = exact_sum(factor * Fraction(rows[i].lower if factor > 0 else rows[i].upper) for i, factor in circuit)
        high = exact_sum(factor * Fraction(rows[i].upper if factor > 0 else rows[i].lower) for i, factor in circuit)
        numbers = ", ".join(str(i) for i, _ in circuit)
        if not any(row) and not low <= 0 <= high:
            return f"input_set: no input keeps its rows {numbers} together"
        if any(row) and not any(_implies(bound, row, low, high) for bound in attainable):
            return f"input_set: no bound keeps what its rows {numbers} leave of the inputs together"
    return None


def _circuits(moved: list[list[Fraction]], dimension: int) -> Iterator[list[tuple[int, Fraction]]]:
    """Yield the circuits, as pairs (row, factor): the linear relations of rows that have minimal support."""
    for size in range(1, dimension + 2):
        for support in combinations(range(len(moved)), size):
            relations = _null_space([[moved[i][k] for i in support] for k in range(dimension)], size)
            if len(relations) == 1 and all(relations[0]):
                yield list(zip(support, relations[0], strict=True))


def _implies(bound: Row, row: list[Fraction], low: Fraction, high: Fraction) -> bool:
    """Return whether low ≤ row · u ≤ high wherever the bound, whose row is a multiple of this one, is kept."""
    first = next(j for j, r in enumerate(row) if r)
    multiple = bound.row[first] / row[first]
    if not multiple or any(b != multiple * r for b, r in zip(bound.row, row, strict=True)):
        return False
    kept = sorted(Fraction(end) / multiple for end in (bound.lower, bound.upper))
    return low <= kept[0] and kept[1] <= high


def _null_space(matrix: list[list[Fraction]], n: int) -> list[list[Fraction]]:
    """Return a basis of all v of n numbers with M v = 0, by elimination."""
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
