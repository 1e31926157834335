"""Sets of states and inputs: intervals, polytopes, and the scales that these give to coordinates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import TYPE_CHECKING, Any, Literal, Self, TypeAlias

import numpy as np
import scipy

from trackably.arguments import numbers
from trackably.arrays import Array, ArrayLike
from trackably.systems.pieces import PolynomialPieces, is_spline, pieces_of_spline

if TYPE_CHECKING:
    from scipy.interpolate import BSpline, PPoly

# Closed intervals: bounds of scalar quantities.

_ROUNDING = 1e-12  # of the width


def rounded_text(value: float, towards: Literal["up", "down"], digits: int = 3) -> str:
    """Format a number, rounded up or down where so many digits do not tell it: what is said then says no more."""
    nearest = f"{value + 0.0:.{digits}g}"  # zero has no sign for people
    if float(nearest) == value or not math.isfinite(value):
        return nearest
    context = Context(digits, ROUND_CEILING if towards == "up" else ROUND_FLOOR)
    return f"{float(context.create_decimal_from_float(value)):.{digits}g}"


def ends_shown(lower: float, upper: float) -> tuple[str, str]:
    """Format two bounds, rounded outwards, with digits that show a thousandth of their distance; with 6 at least."""
    digits = _digits(lower, upper)
    return rounded_text(lower, "down", digits), rounded_text(upper, "up", digits)


def ends_within(lower: float, upper: float) -> tuple[str, str]:
    """Format the ends of what is proved, or covered: as `ends_shown`, but rounded inwards."""
    digits = _digits(lower, upper)
    return rounded_text(lower, "up", digits), rounded_text(upper, "down", digits)


def _digits(lower: float, upper: float) -> int:
    largest, width = max(abs(lower), abs(upper)), abs(upper - lower)
    if not (0 < width < math.inf and largest < math.inf):
        return 6
    return min(max(6, math.ceil(math.log10(largest / width)) + 3), 17)


@dataclass(frozen=True)
class Interval:
    """[lower, upper] with finite lower ≤ upper. ValueError: anything else."""

    lower: float
    upper: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.lower) and math.isfinite(self.upper) and self.lower <= self.upper):
            raise ValueError(f"an interval needs finite bounds, lower ≤ upper, got [{self.lower}, {self.upper}]")

    @property
    def width(self) -> float:
        return self.upper - self.lower

    def ends(self, t: Array) -> tuple[Array, Array]:
        """Return the bounds at t [s]: numbers, or the shape of t where they move."""
        return np.asarray(self.lower), np.asarray(self.upper)

    def at(self, t: float) -> Interval:
        """Return the bounds at one time [s]."""
        return self

    @property
    def rest(self) -> Interval:
        """What is left in the end for something that rests."""
        return self

    @property
    def hull(self) -> Interval:
        """The smallest constant interval that holds the bounds at all times, nearly."""
        return self

    @property
    def periods(self) -> frozenset[float | None]:
        """The periods [s] of the ends that move, None for those that come to rest."""
        return frozenset()

    @property
    def breakpoints(self) -> Array:
        """The times [s] at which a bound may jump or bend, of one period if it has one."""
        return np.empty(0)

    def breakpoints_in(self, start: float, end: float) -> Array:
        """Return the times [s] between these at which a bound may jump or bend."""
        return np.empty(0)

    def margin(self, values: Array, t: Array | None = None) -> Array:
        """Return the distance of each value to the nearer bound, negative outside; at times t [s] if bounds move."""
        lower, upper = (self.lower, self.upper) if t is None else self.ends(t)
        return np.minimum(values - lower, upper - values)

    def strictly_contains(self, value: float) -> bool:
        """Whether a value lies strictly between the bounds."""
        return self.lower < value < self.upper

    def snapped(self, value: float) -> float:
        """Return the bound from which rounding alone tells a value; the value itself where it lies elsewhere."""
        nearer = min((self.lower, self.upper), key=lambda end: abs(value - end))
        return nearer if abs(value - nearer) <= _ROUNDING * self.width else value

    def margin_of(self, other: Interval) -> float:
        """Return the smallest margin of the values in another interval."""
        return min(other.lower - self.lower, self.upper - other.upper)

    def contains(self, other: Interval) -> bool:
        return self.lower <= other.lower and other.upper <= self.upper

    def __str__(self) -> str:
        return f"[{', '.join(ends_shown(self.lower, self.upper))}]"

    @property
    def exactly(self) -> str:
        """As text that tells both bounds exactly: what breaks this interval may not break a wider one."""
        ends = (f"{end:g}" if float(f"{end:g}") == end else repr(end) for end in (self.lower + 0.0, self.upper + 0.0))
        return f"[{', '.join(ends)}]"

    def shown(self, value: float) -> str:
        """Format a value beside the bounds, with the digits that tell it from a bound that it does not equal."""
        value += 0.0  # zero has no sign for people
        for digits in range(_digits(self.lower, self.upper), 17):
            text = f"{value:.{digits}g}"
            if float(text) == value or float(text) not in {self.lower, self.upper}:
                return text
        return repr(value)

    def shrunk(self, by: float) -> Self:
        return type(self)(self.lower + by, self.upper - by)


# Bounds that move in time.

End = float | PolynomialPieces
"""A number; or piecewise polynomials of time, where the end of an interval moves."""

Ends: TypeAlias = "ArrayLike | Sequence[Any] | PolynomialPieces | PPoly | BSpline | Mapping[Any, Any]"
"""Ends of several intervals, or one alone."""

_BETWEEN = np.linspace(0.0, 1.0, 65)[:-1, None]


def shift_end(end: End, by: float) -> End:
    """Return an end plus a number."""
    if not isinstance(end, PolynomialPieces):
        return end + by
    return replace(end, coefficients=end.coefficients + by * np.eye(1, end.degree + 1))


class Corridor(Interval):
    """[low(t), high(t)], of which at least one end moves; the tighter one of both sides counts at a breakpoint.

    `lower` and `upper` raise ValueError: nothing takes an end that moves for a constant. ValueError: an end is only
    known between its breakpoints, or the ends meet.
    """

    low: End
    high: End

    def __init__(self, low: End, high: End) -> None:
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)
        if any(end.beyond == "end" for end in self._moving):
            raise ValueError('set: a bound that moves must be at rest beyond its pieces, or have a period, got "end"')
        if not all(isinstance(end, PolynomialPieces) or math.isfinite(end) for end in (low, high)):
            raise ValueError(f"set: where one bound moves the other must be finite, got {low!r} and {high!r}")
        low_ends, high_ends = self.ends(self._times)
        if not np.all(low_ends < high_ends):
            where = self._times.flat[int(np.argmin(high_ends - low_ends))]
            raise ValueError(f"set: must have an interior at all times, but {self} has none at t = {where:.6g} s")

    if not TYPE_CHECKING:  # else it would stand for any name

        def __getattr__(self, name):
            if name in {"lower", "upper"}:
                raise ValueError(f"bounds: constant ones are needed here, but {self} moves in time")
            raise AttributeError(name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Corridor) and (self.low, self.high) == (other.low, other.high)

    def __hash__(self) -> int:
        return hash((self.low, self.high))

    @property
    def _moving(self) -> list[PolynomialPieces]:
        return [end for end in (self.low, self.high) if isinstance(end, PolynomialPieces)]

    @property
    def periods(self) -> frozenset[float | None]:
        return frozenset(end.period if end.beyond == "period" else None for end in self._moving)

    @property
    def breakpoints(self) -> Array:
        return np.unique(np.concatenate([end.breakpoints for end in self._moving]))

    def breakpoints_in(self, start: float, end: float) -> Array:
        found = []
        for z in self._moving:
            times = z.breakpoints
            if z.beyond == "period":
                turns = np.arange(np.floor((start - times[-1]) / z.period), np.ceil((end - times[0]) / z.period) + 1)
                later = (times[:-1] + turns[turns != 0][:, None] * z.period).ravel()  # rounded: exact ones are beside
                times = np.concatenate([times, np.nextafter(later, -np.inf), later, np.nextafter(later, np.inf)])
            found.append(times)
        times = np.unique(np.concatenate(found))
        return times[(start < times) & (times < end)]

    @property
    def _times(self) -> Array:
        """Times [s] that show where the ends are near to each other."""
        first = self.breakpoints
        return np.append(first[:-1] + _BETWEEN * np.diff(first), first)

    def ends(self, t: Array) -> tuple[Array, Array]:
        before = np.nextafter(t, -np.inf)
        low, high = (
            [end(t), end(before)] if isinstance(end, PolynomialPieces) else [np.asarray(end)] * 2
            for end in (self.low, self.high)
        )
        return np.maximum(*low), np.minimum(*high)

    def at(self, t: float) -> Interval:
        lower, upper = self.ends(np.asarray(t))
        return Interval(float(lower), float(upper))

    @property
    def rest(self) -> Interval:
        if all(end.beyond == "rest" for end in self._moving):
            return self.at(2 * abs(float(self.breakpoints[-1])) + 1.0)
        return self.hull

    @property
    def hull(self) -> Interval:
        lower, upper = self.ends(self._times)
        return Interval(float(np.min(lower)), float(np.max(upper)))

    @property
    def width(self) -> float:
        """The smallest distance of the ends at any time."""
        lower, upper = self.ends(self._times)
        return float(np.min(upper - lower))

    def shrunk(self, by: float) -> Self:
        return type(self)(shift_end(self.low, by), shift_end(self.high, -by))

    def __str__(self) -> str:
        return f"{self.hull} (which moves in time)"


def interval(low: End, high: End) -> Interval:
    """Return the interval between two ends."""
    if isinstance(low, PolynomialPieces) or isinstance(high, PolynomialPieces):
        return Corridor(low, high)
    return Interval(low, high)


# State and input sets: polytopes as bounds of linear combinations; boxes and half-spaces are converted to them.

_OUTWARDS = 1e-6  # relative: solvers find the minimum up to less than this


@dataclass(frozen=True, eq=False)
class Polytope:
    """{x : lower ≤ R x ≤ upper} with `rows` R (r, n) and finite `lower` < `upper` (r,), in `dimension` n.

    The dimension may be left out if there are rows; a set without rows is unbounded. A bound may move in time: then it
    is a `PolynomialPieces` instead of a number, as of `PolynomialPieces.steps`, a spline of SciPy, or a table
    {time [s]: value}, and `lower` and `upper` of the set raise ValueError. ValueError: shapes do not fit, a bound is
    not finite, or the set has no interior.
    """

    rows: Array
    lower: Array
    upper: Array
    dimension: int = 0

    if TYPE_CHECKING:  # arrays are made of what is given

        def __init__(
            self,
            rows: ArrayLike,
            lower: Ends,
            upper: Ends,
            dimension: int = 0,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not self.dimension:
            object.__setattr__(self, "dimension", int(np.shape(self.rows)[-1]))
        if not np.size(self.rows):
            object.__setattr__(self, "rows", np.empty((0, self.dimension)))
        rows = numbers("set: rows", self.rows)
        if rows.ndim != 2 or not rows.shape[1] == self.dimension > 0:
            raise ValueError(f"set: rows must be a matrix with a column for each coordinate, got {rows.shape}")
        if _move(self.lower, self.upper):
            self._move(rows)
            return
        r, ends = len(rows), [numbers(f"set: {name}", getattr(self, name)) for name in ("lower", "upper")]
        if [of.shape for of in ends] != [(r,), (r,)]:
            raise ValueError(f"set: {r} rows need as many bounds, got {ends[0].shape} and {ends[1].shape}")
        for name, of in zip(("rows", "lower", "upper"), (rows, *ends), strict=True):
            of.flags.writeable = False
            object.__setattr__(self, name, of)
        for i, (row, low, high) in enumerate(zip(self.rows, self.lower, self.upper, strict=True)):
            if not (np.all(np.isfinite(row)) and np.any(row) and -np.inf < low <= high < np.inf):
                raise ValueError(f"set: row {i} needs finite entries, not all zero, and finite bounds, lower ≤ upper, "
                                 f"got {row.tolist()} in [{low}, {high}]")  # fmt: skip
        if r and not self.depth > 0:
            raise ValueError(f"set: must have an interior, but no point lies strictly inside {self}")

    def _move(self, rows: Array) -> None:
        """Keep the bounds as intervals, of which some move."""
        pairs = list(zip(self.lower, self.upper, strict=True))
        if len(pairs) != len(rows):
            raise ValueError(f"set: {len(rows)} rows need as many bounds, got {len(pairs)}")
        made = tuple(interval(*map(_end, of)) for of in pairs)
        rows.flags.writeable = False
        for name, value in (("rows", rows), ("_moving", made)):
            object.__setattr__(self, name, value)
        for name in ("lower", "upper"):
            object.__delattr__(self, name)
        for t in np.unique(np.concatenate([of.breakpoints for of in made])).tolist():
            self.at(t)  # which has an interior

    if not TYPE_CHECKING:  # else it would stand for any name

        def __getattr__(self, name):
            if name in {"lower", "upper"}:
                raise ValueError(f"set: constant bounds are needed here, but those of {self} move in time")
            raise AttributeError(name)

    @property
    def moves(self) -> bool:
        """Whether a bound moves in time."""
        return "_moving" in vars(self)

    def at(self, t: float) -> Polytope:
        """Return the set at a time [s]; at a breakpoint, what both sides have in common."""
        if not self.moves:
            return self
        return self._with([bounds.at(t) for _, bounds in self.intervals])

    @property
    def hull(self) -> Polytope:
        """The smallest set with constant bounds that holds this one at all times, nearly."""
        return self._with([bounds.hull for _, bounds in self.intervals]) if self.moves else self

    def _with(self, ends: Sequence[Interval]) -> Polytope:
        return Polytope(self.rows, [of.lower for of in ends], [of.upper for of in ends], self.dimension)

    @classmethod
    def box(cls, lower: Ends, upper: Ends) -> Self:
        """Return {x : lower ≤ x ≤ upper} with bounds of shape (n,); two infinite bounds leave a coordinate free.

        A bound that moves in time is given as for the class.

        ValueError: only one of two bounds is infinite, shapes differ, or the box has no interior.
        """
        if _move(lower, upper):
            lows, highs = (np.atleast_1d(np.asarray(of, dtype=object)) for of in (lower, upper))
            both = enumerate(zip(lows, highs, strict=True))
            free = [i for i, of in both if not _move(of) and np.all(np.isinf([*of]))]
            rows = np.delete(np.eye(len(lows)), free, axis=0)
            return cls(rows, np.delete(lows, free), np.delete(highs, free), len(lows))
        low, high = box_ends("set", lower, upper)
        for i in np.flatnonzero(~(low < high)).tolist():
            ends = ", ".join(ends_shown(float(low[i]), float(high[i])))
            raise ValueError(f"set: must have an interior, got [{ends}] for coordinate {i + 1}")
        bounded = ~(np.isinf(low) & np.isinf(high))
        for i in np.flatnonzero(bounded & (np.isinf(low) | np.isinf(high))).tolist():
            raise ValueError(
                f"set: coordinate {i + 1} has the bounds [{low[i]:g}, {high[i]:g}]: give both or none; where one side "
                "does not matter, a bound that is never reached will do"
            )
        return cls(np.eye(len(low))[bounded], low[bounded], high[bounded], len(low))

    @classmethod
    def halfspaces(cls, H: ArrayLike, h: ArrayLike) -> Self:
        """Return the bounded set {x : H x ≤ h} with H (r, n) and h (r,).

        Opposite rows become one interval. A row without an opposite gets, as its other bound, a value slightly below
        its minimum on the set, which excludes nothing. ValueError: the set is unbounded or has no interior, or shapes
        do not fit.
        """
        H, h = numbers("set: H", H), numbers("set: h", h)
        if H.ndim != 2 or h.shape != (len(H),) or not H.size:
            raise ValueError(f"set: H must be a matrix with a row for each entry of h, got {H.shape} and {h.shape}")
        if bad := np.flatnonzero(~np.isfinite(np.column_stack([H, h])).all(axis=1)).tolist():
            raise ValueError(
                f"set: row {bad[0]} of H x ≤ h must be finite, got {H[bad[0]].tolist()} and {h[bad[0]]:g}: leave out "
                "what bounds nothing"
            )
        rows: list[Array] = []
        bounds: list[tuple[float, float]] = []
        taken: set[int] = set()
        for i, row in enumerate(H):
            if i in taken:
                continue
            opposite = [j for j in range(i + 1, len(H)) if j not in taken and np.array_equal(H[j], -row)]
            taken.update(opposite[:1])
            lower = -h[opposite[0]] if opposite else _lower_bound(row, H, h)
            rows.append(row)
            bounds.append((float(lower), float(h[i])))
        low, high = np.array(bounds).T
        return cls(np.array(rows), low, high)

    @property
    def depth(self) -> float:
        """The largest margin of any point, relative to the width of each row; ≤ 0 if the set has no interior."""
        if not np.all(self.lower < self.upper):
            return -np.inf
        if np.all(np.count_nonzero(self.rows, axis=0) <= 1):  # no two share a coordinate: each is met in its middle
            return 0.5
        matrix, off, *_ = self._centred
        return deepest(np.vstack([matrix, -matrix]), np.full(2 * len(matrix), 2.0), np.append(1 + off, 1 - off))[0]

    @property
    def ends(self) -> tuple[list[End], list[End]]:
        """The lower and the upper end of each row."""
        if not self.moves:
            return self.lower.tolist(), self.upper.tolist()
        pairs = [(of.low, of.high) if isinstance(of, Corridor) else (of.lower, of.upper) for _, of in self.intervals]
        return [low for low, _ in pairs], [high for _, high in pairs]

    @property
    def widths(self) -> Array:
        """The distance between the bounds of each row, the smallest one where they move: shape (r,)."""
        if self.moves:
            return np.array([bounds.width for _, bounds in self.intervals])
        return np.asarray(self.upper - self.lower)

    @property
    def inequalities(self) -> tuple[Array, Array]:
        """(H, h) of the same set as {x : H x ≤ h}: shapes (2r, n) and (2r,)."""
        return np.vstack([self.rows, -self.rows]), np.concatenate([self.upper, -self.lower])

    @property
    def intervals(self) -> list[tuple[Array, Interval]]:
        """Each row with its bounds."""
        if self.moves:
            made: tuple[Interval, ...] = vars(self)["_moving"]
            return list(zip(self.rows, made, strict=True))
        return [
            (row, Interval(low, high))
            for row, low, high in zip(self.rows, self.lower.tolist(), self.upper.tolist(), strict=True)
        ]

    def extent(self, coordinate: int) -> Interval | None:
        """Return the smallest and the largest value of a coordinate on the set; None where either is infinite."""
        involved = self.rows[:, coordinate] != 0
        if not np.delete(self.rows[involved], coordinate, axis=1).any():  # exact where no other coordinate counts
            ends = np.stack([self.lower, self.upper])[:, involved] / self.rows[involved, coordinate]
            low, high = np.max(np.min(ends, axis=0), initial=-np.inf), np.min(np.max(ends, axis=0), initial=np.inf)
        else:
            matrix, off, units, centre = self._centred
            direction = np.eye(self.dimension)[coordinate]
            H, h = np.vstack([matrix, -matrix]), np.append(1 + off, 1 - off)
            ends = np.array([_least(direction, H, h), -_least(-direction, H, h)])
            low, high = np.sort(units[coordinate] * (centre[coordinate] + ends))  # of thin sets, rounding may swap them
        return Interval(float(low), float(high)) if np.isfinite([low, high]).all() else None

    @property
    def _centred(self) -> tuple[Array, Array, Array, Array]:
        """M (r, n), o (r,), units s and a centre z (n,) with R x within its bounds where |M y - o| ≤ 1, x = s (y + z).

        Solvers treat numbers above 1e15 as infinite and below 1e-9 as zero.
        """
        half = np.maximum(self.upper / 2 - self.lower / 2, np.finfo(float).smallest_subnormal)
        sizes = np.abs(self.rows)
        with np.errstate(over="ignore"):
            unit = np.min(np.divide(half[:, None], sizes, out=np.full_like(sizes, np.inf), where=sizes > 0), axis=0)
        units = np.asarray(np.where(np.isfinite(unit), unit, 1.0), dtype=float)
        matrix, middle = self.rows * units / half[:, None], (self.upper / 2 + self.lower / 2) / half
        centre = np.asarray(np.linalg.lstsq(matrix, middle)[0], dtype=float)
        return matrix, middle - matrix @ centre, units, centre

    def margin(self, points: Array) -> Array:
        """Return the smallest distance of R x to a bound at points (…, n), in units of R x: (…,), negative outside."""
        values = np.asarray(points) @ self.rows.T
        return np.asarray(np.min(np.minimum(values - self.lower, self.upper - values), axis=-1, initial=np.inf))

    def __str__(self) -> str:
        sides = []
        for row, bounds in self.intervals:
            if isinstance(bounds, Corridor):
                sides.append(f"{_formula(row)} in {bounds}")
                continue
            first, last = ends_shown(bounds.lower, bounds.upper)
            sides.append(f"{first} ≤ {_formula(row)} ≤ {last}")
        return "{x : " + ", ".join(sides) + "}"


def box_as_written(lower: Sequence[Any], upper: Sequence[Any]) -> Polytope:
    """Return the box of a file's lists: None where a coordinate is free, a mapping where a bound moves in time.

    Raises as `Polytope.box` and `PolynomialPieces.from_mapping`.
    """
    low, high = ([free if end is None else end for end in of] for of, free in ((lower, -math.inf), (upper, math.inf)))
    return Polytope.box(low, high)


def _move(*ends: object) -> bool:
    """Return whether some of the ends move in time."""
    return any(
        isinstance(end, PolynomialPieces | Mapping) or is_spline(end)
        for of in ends
        for end in np.atleast_1d(np.asarray(of, dtype=object))
    )


def _end(given: Any) -> End:
    """Return an end of an interval, which users give as one, as a spline of SciPy, or as a table. ValueError: neither.

    A spline rests before its first breakpoint and after its last one, or repeats if it extrapolates periodically.
    """
    if isinstance(given, Mapping):
        return PolynomialPieces.from_mapping(given)
    if is_spline(given):
        ends, c = pieces_of_spline(given)
        if c.ndim != 2:
            raise ValueError(f"set: expected one value of a spline at a time, got {c.shape[2:]}")
        return PolynomialPieces(ends, c.T, "period" if given.extrapolate == "periodic" else "rest")
    return given if isinstance(given, PolynomialPieces) else float(given)


def box_ends(what: str, lower: Any, upper: Any) -> tuple[Array, Array]:
    """Return the bounds of a box as arrays (n,), numbers as those of one coordinate. ValueError: shapes differ."""
    low, high = (np.atleast_1d(numbers(f"{what}: {name}", of)) for name, of in (("lower", lower), ("upper", upper)))
    if low.shape != high.shape or low.ndim != 1:
        raise ValueError(f"{what}: as many lower as upper bounds are needed, got {low.shape} and {high.shape}")
    return low, high


def deepest(rows: Array, shares: Array, limits: Array) -> tuple[float, Array]:
    """Return the largest t ≤ 1 for which some x has rows x + t shares ≤ limits, and such an x (n,); −∞ for none."""
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
    """Return the minimum of row · x on {x : H x ≤ h}, which is not empty; −∞ if there is none."""
    program = scipy.optimize.linprog(row, A_ub=H, b_ub=h, bounds=(None, None), method="highs")
    return -np.inf if program.fun is None else float(program.fun)


def _lower_bound(row: Array, H: Array, h: Array) -> float:
    """Return a lower bound, slightly too low, of row · x on {x : H x ≤ h}. ValueError: there is none."""
    if deepest(H, np.zeros(len(H)), h)[0] == -np.inf:
        raise ValueError("set: must have an interior, but H x ≤ h has no solution")
    if (least := _least(row, H, h)) == -np.inf:
        raise ValueError(
            f"set: must be bounded, but {_formula(row)} has no lower bound on it; where it does not matter, a bound "
            "that is never reached will do"
        )
    return least - _OUTWARDS * (1 + abs(least))


def _formula(row: Array) -> str:
    return " + ".join(f"{weight:g} x{i + 1}" for i, weight in enumerate(row.tolist()) if weight)


# Scales that a set gives its coordinates: divided by them, a problem has the same numbers in whatever units.


def extents(bounded: Polytope) -> Array:
    """Return how far each coordinate may move while the others stand still, shape (n,); infinite without bounds."""
    sizes = np.abs(bounded.rows)
    reach = np.divide(bounded.widths[:, None], sizes, out=np.full_like(sizes, np.inf), where=sizes > 0)
    return np.asarray(np.min(reach, axis=0, initial=np.inf))


def unit_scales(bounded: Polytope) -> Array:
    """Return a unit for each coordinate (n,): its extent, and 1 where nothing bounds it."""
    reach = extents(bounded)
    return np.where(np.isfinite(reach), reach, 1.0)


def squares_in_widths(bounded: Polytope) -> Array:
    """Return Σ (row / width)² as a matrix (n, n): a cost of errors as parts of widths; zero where no row bounds."""
    rows = bounded.rows / bounded.widths[:, None]
    return np.asarray(rows.T @ rows)
