"""Bounds of scalar quantities: closed intervals, whose ends may move in time; and numbers as messages show them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from functools import cached_property
from typing import Literal

import numpy as np

from trackably.arrays import Array
from trackably.systems.pieces import PolynomialPieces

_ROUNDING = 1e-12  # a value this near to a bound, relative to the width, differs from it by rounding only


def rounded_text(value: float, towards: Literal["up", "down"], digits: int = 3) -> str:
    """Format a number with at most `digits` significant digits, rounded "up" or "down" if this is not exact.

    Callers choose the direction in which the text claims less than the exact number.
    """
    nearest = f"{value + 0.0:.{digits}g}"  # −0 is shown as 0
    if float(nearest) == value or not math.isfinite(value):
        return nearest
    context = Context(digits, ROUND_CEILING if towards == "up" else ROUND_FLOOR)
    return f"{float(context.create_decimal_from_float(value)):.{digits}g}"


def array_text(values: Array) -> str:
    """Return an array as nested lists of numbers with six digits, for messages."""
    if not values.ndim:
        return f"{float(values) + 0.0:.6g}"  # −0 is shown as 0
    return f"[{', '.join(map(array_text, values))}]"


def ends_shown(lower: float, upper: float) -> tuple[str, str]:
    """Format two bounds, rounded outwards, with enough digits to show a thousandth of their distance, at least 6."""
    digits = _digits(lower, upper)
    return rounded_text(lower, "down", digits), rounded_text(upper, "up", digits)


def ends_within(lower: float, upper: float) -> tuple[str, str]:
    """Format the two ends of a proved range, rounded inwards, with as many digits as `ends_shown` uses.

    An end is shown exactly if it has all these digits up to a rounding error, such as 0.30000000000000004.
    """
    digits = _digits(lower, upper)
    return _inwards(lower, "up", digits), _inwards(upper, "down", digits)


def _inwards(end: float, towards: Literal["up", "down"], digits: int) -> str:
    shown, nearest = rounded_text(end, towards, digits), f"{end:.{digits}g}"
    return repr(end) if shown != nearest and math.isclose(float(nearest), end) else shown


def _digits(lower: float, upper: float) -> int:
    largest, width = max(abs(lower), abs(upper)), abs(upper - lower)
    if not (0 < width < math.inf and largest < math.inf):
        return 6
    return min(max(6, math.ceil(math.log10(largest / width)) + 3), 17)


End = float | PolynomialPieces
"""An end of an interval: a number, or piecewise polynomials of time if the end moves."""

_BETWEEN = np.linspace(0.0, 1.0, 65)[:-1, None]


@dataclass(frozen=True)
class Interval:
    """The closed interval [low, high], or [low(t), high(t)] if an end moves in time.

    At a jump, the tighter value counts. `lower` and `upper` are the ends if both are constant. ValueError: an end is
    not finite, or known only between its breakpoints; lower > upper; or an end moves, and there is no interior at some
    time.
    """

    low: End
    high: End

    def __post_init__(self) -> None:
        if not self.moving:
            if not -math.inf < self.lower <= self.upper < math.inf:
                raise ValueError(f"interval: expected finite bounds, lower ≤ upper, got [{self.lower}, {self.upper}]")
            return
        if any(end.beyond == "end" for end in self.moving):
            raise ValueError(
                'set: a bound that moves must be known at all times: expected pieces with beyond="rest" or "period", '
                'got "end"'
            )
        if not all(isinstance(end, PolynomialPieces) or math.isfinite(end) for end in (self.low, self.high)):
            raise ValueError(
                f"set: if one bound moves in time, the other must be finite, got {self.low!r} and {self.high!r}"
            )
        lower, upper = self.ends(self._times)
        if not np.all(lower < upper):
            where = self._times.flat[int(np.argmin(upper - lower))]
            raise ValueError(
                f"set: must have an interior at all times, but {self} has none at t = {where:.6g} s; at a jump, the "
                "values on both sides hold"
            )

    @property
    def lower(self) -> float:
        """The lower end. ValueError: an end moves in time."""
        return self._constant(self.low)

    @property
    def upper(self) -> float:
        """The upper end. ValueError: an end moves in time."""
        return self._constant(self.high)

    def _constant(self, end: End) -> float:
        if isinstance(end, PolynomialPieces) or self.moving:  # who reads one end expects that both are constant
            raise ValueError(f"bounds: expected constant bounds here, got {self}")
        return end

    @property
    def moving(self) -> list[PolynomialPieces]:
        """The ends of the interval that move in time; none for constant ends."""
        return [end for end in (self.low, self.high) if isinstance(end, PolynomialPieces)]

    @cached_property
    def width(self) -> float:
        """The distance of the ends; the smallest one at any time of a grid if they move."""
        lower, upper = self.ends(self._times)
        with np.errstate(over="ignore"):  # bounds that are never reached may be the largest numbers
            return float(np.min(upper - lower))

    def ends(self, t: Array) -> tuple[Array, Array]:
        """Return the lower and the upper bound at t [s], each a number, or an array of the shape of t if it moves."""
        low, high = (
            end(np.stack([t, np.nextafter(t, -np.inf)])) if isinstance(end, PolynomialPieces) else [np.asarray(end)] * 2
            for end in (self.low, self.high)
        )
        return np.maximum(*low), np.minimum(*high)

    def at(self, t: float) -> Interval:
        """Return the bounds at one time [s]."""
        lower, upper = self.ends(np.asarray(t))
        return Interval(float(lower), float(upper))

    @property
    def rest(self) -> Interval:
        """The final bounds, after all ends have come to rest; the `hull` if an end is periodic."""
        if any(end.beyond == "period" for end in self.moving):
            return self.hull
        return self.at(2 * abs(float(self._times.flat[-1])) + 1.0)

    @property
    def hull(self) -> Interval:
        """The smallest constant interval that contains this one at all times of a grid."""
        lower, upper = self.ends(self._times)
        return Interval(float(np.min(lower)), float(np.max(upper)))

    @property
    def _times(self) -> Array:
        """A grid of times [s] at which the ends are compared: 64 from each breakpoint to the next, and the last one."""
        first = self.breakpoints if self.moving else np.zeros(1)
        return np.append(first[:-1] + _BETWEEN * np.diff(first), first)

    @property
    def periods(self) -> frozenset[float | None]:
        """The periods [s] of the ends that move, None for those that come to rest."""
        return frozenset(end.period if end.beyond == "period" else None for end in self.moving)

    @property
    def breakpoints(self) -> Array:
        """The times [s] at which a bound may jump or bend; of a periodic bound, those of one period."""
        return np.unique(np.concatenate([np.empty(0), *(end.breakpoints for end in self.moving)]))

    def breakpoints_in(self, start: float, end: float) -> Array:
        """Return the times between `start` and `end` [s] at which a bound may jump or bend."""
        times = np.unique(np.concatenate([np.empty(0), *(z.breakpoints_in(start, end) for z in self.moving)]))
        return times[(start < times) & (times < end)]

    def margin(self, values: Array, t: Array | None = None) -> Array:
        """Return the distance of each value to the nearer bound, negative outside, at times t [s] if bounds move."""
        lower, upper = (self.lower, self.upper) if t is None else self.ends(t)
        return np.minimum(values - lower, upper - values)

    def strictly_contains(self, value: float) -> bool:
        """Whether a value lies strictly between the bounds."""
        return self.lower < value < self.upper

    def snapped(self, value: float) -> float:
        """Return the nearer bound if the value differs from it by rounding only; otherwise the value itself."""
        nearer = min((self.lower, self.upper), key=lambda end: abs(value - end))
        return nearer if abs(value - nearer) <= _ROUNDING * self.width else value

    def margin_of(self, other: Interval) -> float:
        """Return the smallest distance of the values in the interval `other` from the ends of this one.

        It is negative if `other` reaches outside.
        """
        return min(other.lower - self.lower, self.upper - other.upper)

    def __str__(self) -> str:
        if self.moving:
            return f"{self.hull} (which moves in time)"
        return f"[{', '.join(ends_shown(self.lower, self.upper))}]"

    @property
    def exactly(self) -> str:
        """Both bounds as text, exactly: a value outside could lie inside of an interval with rounded bounds."""
        ends = (f"{end:g}" if float(f"{end:g}") == end else repr(end) for end in (self.lower + 0.0, self.upper + 0.0))
        return f"[{', '.join(ends)}]"

    def shrunk(self, by: float) -> Interval:
        """Return the interval with both ends moved inwards by `by`."""
        return Interval(move_end(self.low, lambda value: value + by), move_end(self.high, lambda value: value - by))


def move_end(end: End, move: Callable[[float], float]) -> End:
    """Return an end of an interval, moved by a function of numbers; pieces are moved by their values at breakpoints."""
    if not isinstance(end, PolynomialPieces):
        return move(end)
    coefficients = end.coefficients.copy()
    coefficients[:, 0] = [move(value) for value in coefficients[:, 0].tolist()]
    return replace(end, coefficients=coefficients)
