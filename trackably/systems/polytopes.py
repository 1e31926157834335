"""Sets of states and inputs: polytopes, and units for coordinates that follow from the widths of a polytope."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self, TypeAlias

import numpy as np
import scipy

from trackably.arguments import array, numbers
from trackably.arrays import Array, ArrayLike
from trackably.checker import subject
from trackably.checker.subject import weighted_sum_text
from trackably.systems.intervals import End, Interval
from trackably.systems.pieces import PolynomialPieces, is_spline

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, PPoly

Ends: TypeAlias = "ArrayLike | Sequence[Any] | PolynomialPieces | PPoly | BSpline | Mapping[Any, Any]"
"""The lower or the upper bounds of several rows, or of one; each is a number, or a function of time."""

BoundedRow = tuple[tuple[Fraction, ...], Interval]
"""A row of weights, exactly, and the bounds of the weighted sum."""

_OUTWARDS = 1e-6  # a minimum is lowered by this part of 1 + |minimum|, which exceeds the error of the solver


@dataclass(frozen=True, eq=False, repr=False)
class Polytope:
    """{x : lower ≤ R x ≤ upper} with `rows` R (r, n) and finite `lower` < `upper` (r,), in `dimension` n.

    The dimension may be left out if there are rows; a set without rows is unbounded. A bound may move in time: then it
    is a `PolynomialPieces` instead of a number, as from `PolynomialPieces.steps`, a spline of SciPy, or a table
    {time [s]: value}, and `lower` and `upper` of the set raise ValueError. ValueError: shapes do not fit, a bound is
    not finite, or the set has no interior.
    """

    rows: Array
    lower: Array
    upper: Array
    dimension: int

    def __init__(self, rows: ArrayLike, lower: Ends, upper: Ends, dimension: int = 0) -> None:
        unbounded = dimension and not np.size(rows)
        rows = np.empty((0, dimension)) if unbounded else array("set: rows", rows, None, dimension or None)
        lower, upper = _ends("set: lower", lower), _ends("set: upper", upper)
        r, shapes = len(rows), [np.shape(of) for of in (lower, upper)]
        if shapes != [(r,), (r,)]:
            raise ValueError(
                f"set: expected {r} lower and {r} upper bounds, one for each row, got the shapes {shapes[0]} and "
                f"{shapes[1]}"
            )
        for i, (row, low, high) in enumerate(zip(rows, lower, upper, strict=True)):
            is_bounded = _any_moves(low, high) or -np.inf < low <= high < np.inf
            if not (np.any(row) and is_bounded):
                raise ValueError(
                    f"set: row {i} needs entries other than zero, and finite bounds, lower ≤ upper, got {row.tolist()} "
                    f"in [{low + 0.0}, {high + 0.0}]; if one side does not matter, give a bound that is never reached"
                )
        vars(self).update(rows=rows, dimension=rows.shape[1], bounds=[*map(Interval, lower, upper)])
        if self.moves:
            for t in np.unique(np.concatenate([of.breakpoints for of in self.bounds])).tolist():
                self.at(t)  # raises ValueError if it has no interior
        elif r and not self.depth > 0:
            raise ValueError(f"set: must have an interior, but no point lies strictly inside {self}")

    if TYPE_CHECKING:
        bounds: list[Interval]
        """The bounds of each row, which may move in time."""
    else:  # hidden from type checkers, which would then accept any attribute

        def __getattr__(self, name):
            if name not in {"lower", "upper"}:
                raise AttributeError(name)
            ends = np.array([getattr(of, name) for of in self.bounds], dtype=float)  # ValueError if a bound moves
            ends.flags.writeable = False
            return vars(self).setdefault(name, ends)

    @property
    def moves(self) -> bool:
        """Whether a bound moves in time."""
        return any(of.moving for of in self.bounds)

    def at(self, t: float) -> Polytope:
        """Return the set at a time [s]; at a breakpoint, the intersection of the sets before and after it."""
        return self.with_bounds([of.at(t) for of in self.bounds]) if self.moves else self

    @property
    def hull(self) -> Polytope:
        """The set with constant bounds: for each row the smallest interval that contains its bounds on a time grid."""
        return self.with_bounds([of.hull for of in self.bounds]) if self.moves else self

    @property
    def bounded_rows(self) -> list[BoundedRow]:
        """Each row, exactly, with its bounds."""
        return [(tuple(map(Fraction, row)), of) for row, of in zip(self.rows.tolist(), self.bounds, strict=True)]

    @property
    def checked(self) -> subject.Polytope:
        """The same set as an object of the checker's class."""
        ends = ([of.checked if isinstance(of, PolynomialPieces) else of for of in side] for side in self.ends)
        rows = (row for row, _ in self.bounded_rows)
        return subject.Polytope(tuple(map(subject.Row, rows, *ends)), self.dimension)

    def with_bounds(self, bounds: Sequence[Interval]) -> Polytope:
        """Return the set with other bounds of its rows."""
        return Polytope(self.rows, [of.low for of in bounds], [of.high for of in bounds], self.dimension)

    @classmethod
    def box(cls, lower: Ends, upper: Ends) -> Self:
        """Return {x : lower ≤ x ≤ upper} with bounds of shape (n,); two infinite bounds leave a coordinate free.

        A bound may move in time, as in the constructor.

        ValueError: only one of two bounds is infinite, shapes differ, or the box has no interior.
        """
        low, high = (_ends(f"set: {name}", of) for name, of in (("lower", lower), ("upper", upper)))
        if np.shape(low) != np.shape(high) or np.ndim(low) != 1:
            raise ValueError(f"set: lower and upper need the same shape (n,), got {np.shape(low)} and {np.shape(high)}")
        both = list(zip(low, high, strict=True))
        bounded = [i for i, ends in enumerate(both) if ends != (-np.inf, np.inf)]
        return cls(np.eye(len(low))[bounded], [low[i] for i in bounded], [high[i] for i in bounded], len(low))

    @classmethod
    def halfspaces(cls, H: ArrayLike, h: ArrayLike) -> Self:
        """Return the bounded set {x : H x ≤ h} with H (r, n) and h (r,).

        Opposite rows become one interval. A row without an opposite gets, as its other bound, a value slightly below
        its minimum on the set, which excludes nothing. ValueError: the set is unbounded or has no interior, or shapes
        do not fit.
        """
        H = array("set: H", H, None, None)
        h = array("set: h", h, len(H))
        found, left = list[tuple[Array, float, float]](), [*range(len(H))]
        while left:
            i, *left = left
            opposite = [j for j in left if np.array_equal(H[j], -H[i])][:1]
            left = [j for j in left if j not in opposite]
            found.append((H[i], -h[opposite[0]] if opposite else _lower_bound(H[i], H, h), h[i]))
        rows, lower, upper = map(np.array, zip(*found, strict=True))
        return cls(rows, lower, upper)

    @property
    def depth(self) -> float:
        """The largest relative margin of any point; ≤ 0 if there is no interior.

        The relative margin of a point is the smallest of the quotients margin / width of all rows.
        """
        return self._deepest[0] if np.all(self.lower < self.upper) else -np.inf

    @property
    def centre(self) -> Array:
        """A point (n,) with the largest relative margin (`depth`); coordinates that nothing bounds are zero."""
        return self._deepest[1]

    @cached_property
    def _deepest(self) -> tuple[float, Array]:
        H, h, units, centre = self.centred
        if np.all(np.count_nonzero(self.rows, axis=0) <= 1):  # rows share no coordinate: each can be at its middle
            return 0.5, units * centre
        found = deepest(H, np.full(len(H), 2.0), h)
        return found[0], units * (centre + found[1])

    @property
    def ends(self) -> tuple[list[End], list[End]]:
        """The lower bounds and the upper bounds of all rows; each is a number, or pieces if it moves in time."""
        return [of.low for of in self.bounds], [of.high for of in self.bounds]

    @property
    def widths(self) -> Array:
        """The distance between the bounds of each row, the smallest one where they move: shape (r,)."""
        return np.array([of.width for of in self.bounds], dtype=float)

    @property
    def inequalities(self) -> tuple[Array, Array]:
        """(H, h) of the same set as {x : H x ≤ h}: shapes (2r, n) and (2r,)."""
        return np.vstack([self.rows, -self.rows]), np.concatenate([self.upper, -self.lower])

    def extent(self, coordinate: int) -> Interval | None:
        """Return the smallest and the largest value of a coordinate on the set; None where either is infinite."""
        involved = self.rows[:, coordinate] != 0
        if not np.delete(self.rows[involved], coordinate, axis=1).any():  # these rows have no other coordinate
            ends = np.stack([self.lower, self.upper])[:, involved] / self.rows[involved, coordinate]
            low, high = np.max(np.min(ends, axis=0), initial=-np.inf), np.min(np.max(ends, axis=0), initial=np.inf)
        else:
            (H, h, units, centre), direction = self.centred, np.eye(self.dimension)[coordinate]
            ends = np.array([_least(direction, H, h), -_least(-direction, H, h)])
            low, high = np.sort(units[coordinate] * (centre[coordinate] + ends))  # of thin sets, rounding may swap them
        return Interval(float(low), float(high)) if np.isfinite([low, high]).all() else None

    @property
    def centred(self) -> tuple[Array, Array, Array, Array]:
        """H (2r, n), h (2r,), s (n,), z (n,) such that x = s (y + z) satisfies the bounds if and only if H y ≤ h.

        Linear programs are solved for y, whose entries are near 1 in all units: solvers treat numbers above 1e15 as
        infinite, and numbers below 1e-9 as zero.
        """
        half = np.maximum(self.upper / 2 - self.lower / 2, np.finfo(float).smallest_subnormal)
        units = _units(_reach(self.rows, half))
        matrix, middle = self.rows * units / half[:, None], (self.upper / 2 + self.lower / 2) / half
        centre = np.asarray(np.linalg.lstsq(matrix, middle)[0], dtype=float)
        off = middle - matrix @ centre
        return np.vstack([matrix, -matrix]), np.append(1 + off, 1 - off), units, centre

    def margin(self, points: Array) -> Array:
        """Return the smallest distance of R x to a bound at points (…, n), in units of R x; negative outside."""
        values = np.asarray(points) @ self.rows.T
        return np.asarray(np.min(np.minimum(values - self.lower, self.upper - values), axis=-1, initial=np.inf))

    def __repr__(self) -> str:
        sides = (f"{_formula(row)} in {bounds}" for row, bounds in zip(self.rows, self.bounds, strict=True))
        return f"{{x : {', '.join(sides)}}}"


def _any_moves(*ends: object) -> bool:
    return any(isinstance(end, PolynomialPieces) for end in ends)


def _ends(what: str, given: Any) -> list[Any]:
    """Return the ends of intervals as numbers or pieces; users may also give splines of SciPy, or tables.

    A spline rests before its first breakpoint and after its last one, or repeats if it extrapolates periodically.
    """
    ends = list(map(_end, np.atleast_1d(np.asarray(given, dtype=object))))
    if _any_moves(*ends):
        return [end if _any_moves(end) else float(end) for end in ends]
    return list(np.atleast_1d(numbers(what, given)).tolist())


def _end(given: Any) -> Any:
    """Return a bound that moves in time (a table or a spline) as pieces, and anything else unchanged."""
    if isinstance(given, Mapping):
        return PolynomialPieces.from_mapping(given)
    if is_spline(given):
        return PolynomialPieces.of_spline(given, "period" if given.extrapolate == "periodic" else "rest")
    return given


def deepest(rows: Array, shares: Array, limits: Array) -> tuple[float, Array]:
    """Return the largest t ≤ 1 for which some x (n,) satisfies rows x + t shares ≤ limits, and this x.

    If there is no such t, return −∞ and zeros.
    """
    n = rows.shape[1]
    program = scipy.optimize.linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=np.column_stack([rows, shares]),
        b_ub=limits,
        bounds=[(None, None)] * n + [(None, 1.0)],
        method="highs",
    )
    return (-np.inf, np.zeros(n)) if program.x is None else (float(program.x[-1]), np.asarray(program.x[:n]))


def _least(row: Array, H: Array, h: Array) -> float:
    """Return the minimum of row · x on the nonempty set {x : H x ≤ h}; −∞ if there is no minimum."""
    program = scipy.optimize.linprog(row, A_ub=H, b_ub=h, bounds=(None, None), method="highs")
    return -np.inf if program.fun is None else float(program.fun)


def _lower_bound(row: Array, H: Array, h: Array) -> float:
    """Return a lower bound, slightly too low, of row · x on {x : H x ≤ h}. ValueError: there is none."""
    if deepest(H, np.zeros(len(H)), h)[0] == -np.inf:
        raise ValueError("set: must have an interior, but H x ≤ h has no solution")
    if (least := _least(row, H, h)) == -np.inf:
        raise ValueError(
            f"set: must be bounded, but {_formula(row)} has no lower bound on it; if no bound is meant, give one that "
            "is never reached"
        )
    return least - _OUTWARDS * (1 + abs(least))


def _formula(row: Array) -> str:
    """Return row · x as text, for example "x1-2x2"."""
    return weighted_sum_text([*map(Fraction, row.tolist())], [f"x{i + 1}" for i in range(len(row))], 6)


# Scales of coordinates, from the widths of a set: a problem divided by them has the same numbers in all units.


def extents(bounded: Polytope) -> Array:
    """Return how much each coordinate may change while all others are constant, shape (n,); infinite without bounds."""
    return _reach(bounded.rows, bounded.widths)


def unit_scales(bounded: Polytope) -> Array:
    """Return a unit for each coordinate, shape (n,): the largest change that the set allows, 1 without bounds."""
    return _units(extents(bounded))


def _reach(rows: Array, widths: Array) -> Array:
    """Return by how much each coordinate, alone, may change until a row changes by its width; infinite if none does."""
    sizes = np.abs(rows)
    with np.errstate(over="ignore"):
        reach = np.divide(widths[:, None], sizes, out=np.full_like(sizes, np.inf), where=sizes > 0)
    return np.asarray(np.min(reach, axis=0, initial=np.inf))


def _units(reach: Array) -> Array:
    return np.where(np.isfinite(reach), reach, 1.0)


def slacks(bounded: Polytope, points: Array, times: Array | None = None) -> Array:
    """Return the slacks of points (…, n) in a set with r rows, relative to the widths: shape (…, 2r).

    They are the distances to the upper bounds, then to the lower ones, negative outside. Moving bounds are evaluated at
    the `times` [s] (N,) of N points.
    """
    values = points @ bounded.rows.T
    if times is None or not bounded.moves:
        lower, upper = bounded.lower, bounded.upper
    else:
        ends = [[np.broadcast_to(end, times.shape) for end in of.ends(times)] for of in bounded.bounds]
        lower, upper = np.transpose(ends, (1, 2, 0))
    return np.concatenate([upper - values, values - lower], axis=-1) / np.tile(bounded.widths, 2)


def rows_in_widths(bounded: Polytope, scales: Array) -> Array:
    """Return M (2r, n) such that `slacks` fall by M z if a point moves by z, in units of `scales` (n,)."""
    return np.vstack([bounded.rows, -bounded.rows]) * scales / np.tile(bounded.widths, 2)[:, None]
