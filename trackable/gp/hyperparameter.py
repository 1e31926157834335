"""Hyperparameters: known numbers, or learned from samples within an interval.

A field that is a `Hyperparameter` takes a number (known), a pair (learned between the two), or nothing (learned in an
interval chosen from the samples). Its value is always a number; one that is learned is a `Learned`, the present value
with its interval. Nothing else says which hyperparameters are learned.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Self, overload

Interval = tuple[float, float]


@dataclass(frozen=True)
class Scales:
    """Sizes that `count` samples show: the signal's `amplitude`, `span` and smallest `spacing` [s] of the times."""

    amplitude: float
    span: float
    spacing: float
    count: int


class Search(NamedTuple):
    """The interval in which a hyperparameter is sought, and the one from which searches start.

    They start in the middle half of the bounds (of their logarithms) where `starts` is None.
    """

    bounds: Interval
    starts: Interval | None = None


class Learned(float):
    """The present value of a hyperparameter that is learned in `interval`; None: in one chosen from the samples."""

    __slots__ = ("interval",)
    interval: Interval | None

    def __new__(cls, value: float, interval: Interval | None = None) -> Self:
        learned = super().__new__(cls, value)
        learned.interval = interval
        return learned

    @classmethod
    def within(cls, lower: float, upper: float) -> Self:
        """Return a hyperparameter learned between two numbers, now in their middle (of the logarithms)."""
        return cls(math.sqrt(lower * upper), (lower, upper))


class Hyperparameter:
    """A positive field of a frozen dataclass, known or learned; `search` chooses the interval that is not given."""

    def __init__(self, search: Callable[[Scales], Search]) -> None:
        self.search = search
        self.name = ""

    def __set_name__(self, _: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, owner: None, kind: type) -> None: ...

    @overload
    def __get__(self, owner: object, kind: type) -> float: ...

    def __get__(self, owner: object | None, kind: type) -> float | None:
        if owner is None:
            return None  # what a dataclass takes for the default: left out, it is learned
        value: float = vars(owner)[self.name]
        return value

    def __set__(self, owner: object, given: float | Interval | None) -> None:
        try:
            vars(owner)[self.name] = hyperparameter(given)
        except ValueError as error:
            raise ValueError(f"{type(owner).__name__}: {self.name} must be {error}, got {given!r}") from None


def hyperparameter(given: Any) -> float:
    """Return a hyperparameter as it is stored. ValueError, whose message says what is expected, for what is none."""
    match given:
        case None:
            return Learned(1.0)
        case (lower, upper) if _is_positive(lower) and _is_positive(upper) and lower < upper:
            return Learned.within(float(lower), float(upper))
        case _ if _is_positive(given):
            return given if isinstance(given, Learned) else float(given)
    raise ValueError("a positive number (known) or [lower, upper] with 0 < lower < upper (learned)")


def learned(value: float) -> Learned:
    """Return a hyperparameter that is learned, now at a value; one that is learned already keeps its interval."""
    return value if isinstance(value, Learned) else Learned(value)


def at(stored: float, value: float) -> float:
    """Return a hyperparameter at another value: learned as it was, or known."""
    return Learned(value, stored.interval) if isinstance(stored, Learned) else float(value)


def amplitude(scales: Scales) -> Search:
    """Search for a standard deviation of the signal; it may have to fade far before a reference is feasible."""
    return Search(*_times(scales.amplitude, (1e-12, 1e3), (0.1, 10.0)))


def noise(scales: Scales) -> Search:
    """Search for the standard deviation of noise."""
    return Search(*_times(scales.amplitude, (1e-4, 1e1), (1e-2, 1.0)))


def duration(scales: Scales) -> Search:
    """Search for a time [s] over which the signal changes."""
    return Search((scales.spacing / 10, 100 * scales.span))


def fraction_of_period(_: Scales) -> Search:
    """Search for a length scale that is measured in periods."""
    return Search((0.1, 10.0))


def repetition(scales: Scales) -> Search:
    """Search for a time [s] after which the signal repeats.

    The samples show it once at least, and three of them fall into it: with two it may be an alias. Local minima lie
    everywhere between.
    """
    whole = scales.span * min(0.5, 3 / max(scales.count - 1, 1)), scales.span
    return Search(whole, whole)


def tail_weight(_: Scales) -> Search:
    """Search for the shape of a rational quadratic kernel: a number without unit."""
    return Search((1e-2, 1e4), (0.3, 30.0))


def _times(scale: float, bounds: Interval, starts: Interval) -> tuple[Interval, Interval]:
    return (bounds[0] * scale, bounds[1] * scale), (starts[0] * scale, starts[1] * scale)


def _is_positive(given: object) -> bool:
    return isinstance(given, int | float) and not isinstance(given, bool) and 0 < given < math.inf
