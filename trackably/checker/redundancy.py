"""Redundant inputs, an extension: if u(t) keeps attainable rows, some input in U acts as u(t) does.

Theorem. The certificate of a linear system may also hold `attainable` rows; u(t) is then bounded by these rows
instead of U. If `check` answers Proved, then at each of the claimed times there is a v(t) with B v(t) = 0 and u(t) +
v(t) ∈ U. So the system follows the states x(k T) with the admissible inputs u(k T) + v(k T).

Proof. Let the columns of Z span the kernel of B. By Farkas' lemma there is a w with lower_i ≤ r_i (u + Z w) ≤ upper_i
for all rows of U if Σ_i λ_i r_i u lies between Σ_i λ_i lower_i and Σ_i λ_i upper_i (ends exchanged where λ_i < 0) for
all λ with Σ_i λ_i r_i Z = 0. It is enough to know this for the λ of minimal support, because every other λ is a
conformal sum of these (no cancellation of signs): R. T. Rockafellar, The elementary vectors of a subspace of R^N,
1969. The λ of minimal support are enumerated. The inequality of each must follow from an attainable row; this is
verified in rational arithmetic.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations
from math import comb

from trackably.checker.answers import FailedStepError
from trackably.checker.intervals import exact_dot, exact_sum
from trackably.checker.subject import Bound, LinearSystem, Row, Subject
from trackably.checker.watch import short, tick

_MOST = 10_000


def check_input_set(subject: Subject) -> None:
    """Raise FailedStepError if some u that keeps the attainable rows may have no v with B v = 0 and u + v ∈ U.

    Without attainable rows, there is nothing to show.
    """
    system, rows = subject.system, subject.input_set.rows
    if subject.attainable is None or not isinstance(system, LinearSystem):
        return
    _check_enumerable(system, rows)
    for demand in demands(idle_inputs(system), rows):
        if not any(demand.row) and not demand.low <= 0 <= demand.high:
            raise FailedStepError(f"input_set: no input keeps all of its rows {demand.numbers} (counted from 0)")
        if any(demand.row) and not any(
            ends[0] <= bound.ends[0] and bound.ends[1] <= ends[1]
            for bound in subject.attainable
            if (ends := _scale(demand, bound.row))
        ):
            rows_of = f"its rows {demand.numbers} (counted from 0)"
            raise FailedStepError(f"input_set: no row of `attainable` implies the inequality to which {rows_of} add up")


def demand_of(system: LinearSystem, rows: tuple[Row, ...], bound: Bound) -> tuple[Fraction, Fraction] | None:
    """Return low and high: if u + v ∈ U for some v with B v = 0, then low ≤ row · u ≤ high, with the row of `bound`.

    `rows` are those of U. Return None if they imply no such bounds, or are too many to enumerate.
    """
    try:
        _check_enumerable(system, rows)
    except FailedStepError:
        return None
    found = [ends for demand in demands(idle_inputs(system), rows) if (ends := _scale(demand, bound.row))]
    if not found:
        return None
    lows, highs = zip(*found, strict=True)
    return min(bound.ends[0], max(lows)), max(bound.ends[1], min(highs))


@dataclass(frozen=True)
class Demand:
    """A condition low ≤ row · u ≤ high that is necessary for u + v to be in U for some v with B v = 0.

    It follows from the rows of U with these `numbers`, a text such as "0, 3".
    """

    row: list[Fraction]
    low: Fraction
    high: Fraction
    numbers: str


def _check_enumerable(system: LinearSystem, rows: tuple[Row, ...]) -> None:
    if any(side.ends[0] > side.ends[1] for side in rows):
        raise FailedStepError("input_set: every row needs lower ≤ upper")
    idle = idle_inputs(system)
    if sum(comb(len(rows), size) for size in range(1, len(idle) + 2)) > _MOST:
        raise FailedStepError(
            f"input_set: {len(rows)} rows have too many combinations of up to {len(idle) + 1} rows to check"
        )


def demands(idle: list[list[Fraction]], rows: Sequence[Row]) -> Iterator[Demand]:
    """Yield a condition on u for each λ of minimal support with Σ_i λ_i r_i v = 0 for all v in `idle`.

    Here r_i are the `rows` of U, and `idle` is a basis of all v with B v = 0.
    """
    m = len(rows[0].row) if rows else 0
    moved = [[exact_dot(side.row, v) for v in idle] for side in rows]
    for circuit in _circuits(moved, len(idle)):
        row = [exact_sum(factor * rows[i].row[j] for i, factor in circuit) for j in range(m)]
        low = exact_sum(factor * rows[i].ends[factor < 0] for i, factor in circuit)
        high = exact_sum(factor * rows[i].ends[factor > 0] for i, factor in circuit)
        yield Demand(row, low, high, ", ".join(str(i) for i, _ in circuit))


def idle_inputs(system: LinearSystem) -> list[list[Fraction]]:
    """Return a basis of all v with B v = 0."""
    return null_space(system.exact[1], len(system.inputs))


def _circuits(moved: list[list[Fraction]], dimension: int) -> Iterator[list[tuple[int, Fraction]]]:
    """Yield each λ of minimal support with Σ_i λ_i moved[i] = 0, up to a factor, as pairs (i, λ_i) with λ_i ≠ 0.

    Each moved[i] has `dimension` numbers.
    """
    for size in range(1, dimension + 2):
        for support in combinations(range(len(moved)), size):
            relations = null_space([[moved[i][k] for i in support] for k in range(dimension)], size)
            if len(relations) == 1 and all(relations[0]):
                yield list(zip(support, relations[0], strict=True))


def _scale(demand: Demand, row: tuple[Fraction, ...]) -> tuple[Fraction, Fraction] | None:
    """Return low and high of the condition low ≤ row · u ≤ high that equals the `demand`.

    Return None if `row` is no multiple of the demand's own row, or if one of both rows is zero.
    """
    tick()
    first = next((j for j, r in enumerate(demand.row) if r), None)
    multiple = row[first] / demand.row[first] if first is not None else Fraction(0)
    if not multiple or any(b != multiple * r for b, r in zip(row, demand.row, strict=True)):
        return None
    low, high = sorted((multiple * demand.low, multiple * demand.high))
    return low, high


def row_echelon(matrix: list[list[Fraction]], n: int) -> tuple[list[list[Fraction]], list[int]]:
    """Return the reduced row echelon form of a matrix with n columns, and the columns of its pivots."""
    rows = [list(row) for row in matrix]
    pivots: list[int] = []
    for j in range(n):
        at = len(pivots)
        found = next((i for i in range(at, len(rows)) if rows[i][j]), None)
        if found is None:
            continue
        rows[at], rows[found] = rows[found], rows[at]
        rows[at] = [short(r / rows[at][j]) for r in rows[at]]
        for i in range(len(rows)):
            if i != at and rows[i][j]:
                rows[i] = [short(r - rows[i][j] * p) for r, p in zip(rows[i], rows[at], strict=True)]
        pivots.append(j)
    return rows, pivots


def null_space(matrix: list[list[Fraction]], n: int) -> list[list[Fraction]]:
    """Return a basis of all v with M v = 0, by elimination, for a `matrix` M with n columns."""
    rows, pivots = row_echelon(matrix, n)
    basis = []
    for free in (j for j in range(n) if j not in pivots):
        v = [Fraction(int(j == free)) for j in range(n)]
        for i, pivot in enumerate(pivots):
            v[pivot] = -rows[i][free]
        basis.append(v)
    return basis
