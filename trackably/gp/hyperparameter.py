"""Hyperparameters: known numbers, or learned from samples within an interval.

A `Hyperparameter` field takes a number (known), a pair (learned between the two), or nothing (learned in an interval
chosen from the samples). Its value is a number. The value of a learned hyperparameter is a `Learned`: the present
value with the interval. Only this type says which hyperparameters are learned.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self, overload

from trackably.arguments import is_number

Interval = tuple[float, float]


@dataclass(frozen=True)
class Scales:
    """Scales of `count` samples: the signal's `amplitude`, and the `span` and smallest `spacing` [s] of the times.

    A learned length scale (a time over which the signal changes) is sought above the `shortest` [s].
    """

    amplitude: float
    span: float
    spacing: float
    count: int
    shortest: float = 0.0


class Search(NamedTuple):
    """The `bounds` between which a hyperparameter is sought, and the interval `starts` in which searches start.

    If `starts` is None, searches start in the middle half of the bounds (of their logarithms).
    """

    bounds: Interval
    starts: Interval | None = None


class Learned(float):
    """The current value of a hyperparameter learned in `interval`; if this is None, `default` chooses one from samples.

    The field of a kernel or a prior that takes the value sets its own `default`.
    """

    __slots__ = ("default", "interval")
    interval: Interval | None
    default: Callable[[Scales], Search] | None

    def __new__(
        cls, value: float, interval: Interval | None = None, default: Callable[[Scales], Search] | None = None
    ) -> Self:
        learned = float.__new__(cls, value)
        learned.interval, learned.default = interval, default
        return learned

    def search(self, scales: Scales) -> Search:
        """Return the search interval: the user's, or one chosen from the samples' `scales`."""
        if self.interval:
            return Search(self.interval)
        assert self.default, "a kernel or a prior holds this value"
        return self.default(scales)


class Hyperparameter:
    """A positive field of a frozen dataclass, known or learned; `search` gives the interval if the user gives none."""

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
            return None  # the default that the dataclass sees: a hyperparameter that is not given is learned
        value: float = vars(owner)[self.name]
        return value

    def __set__(self, owner: object, given: float | Interval | None) -> None:
        try:
            value = hyperparameter(given)
        except ValueError as error:
            raise ValueError(f"{type(owner).__name__}: {self.name} must be {error}, got {given!r}") from None
        if isinstance(value, Learned):
            value = Learned(value, value.interval, self.search)
        vars(owner)[self.name] = value


def hyperparameter(given: Any) -> float:
    """Return what a user gives as it is stored: a number (known) as a float, a pair or None (learned) as a `Learned`.

    ValueError: the given value is none of these; the message says what is expected.
    """
    match given:
        case None:
            return Learned(1.0)
        case (lower, upper) if _is_positive(lower) and _is_positive(upper) and lower < upper:
            interval = float(lower), float(upper)
            return Learned(math.sqrt(math.prod(interval)), interval)
        case _ if _is_positive(given):
            return given if isinstance(given, Learned) else float(given)
    raise ValueError("a positive number (known) or [lower, upper] with 0 < lower < upper (learned)")


def as_text(value: float) -> str:
    """Return a hyperparameter as text: its value, and whether it is learned and in which interval."""
    if not isinstance(value, Learned):
        return repr(value)
    within = "" if value.interval is None else f" in [{value.interval[0]:.4g}, {value.interval[1]:.4g}]"
    return f"{value:.4g} (learned{within})"


class Parametrized(ABC):
    """An object with named hyperparameters: a kernel, the prior of a process, or the priors of several processes."""

    @property
    @abstractmethod
    def hyperparameters(self) -> dict[str, float]:
        """Names and values of the hyperparameters (not logarithms of values), in the order of every gradient."""

    @cached_property
    def learned(self) -> tuple[str, ...]:
        """Names of the hyperparameters that are learned, in the order of every gradient."""
        return tuple(name for name, value in self.hyperparameters.items() if isinstance(value, Learned))

    @abstractmethod
    def map_values(self, change: Callable[[str, float], float]) -> Self:
        """Return the same object with `change(name, value)` for the value of each hyperparameter."""

    def with_hyperparameters(self, values: Mapping[str, float]) -> Self:
        """Return the same object with other values of the named hyperparameters; learned ones stay learned.

        TypeError for unknown names.
        """
        if unknown := values.keys() - self.hyperparameters.keys():
            raise TypeError(
                f"{type(self).__name__} has no hyperparameter {', '.join(sorted(unknown))}; "
                f"it has {', '.join(self.hyperparameters)}"
            )

        def moved(name: str, value: float) -> float:
            new = values.get(name, value)
            return Learned(new, value.interval) if isinstance(value, Learned) else float(new)

        return self.map_values(moved)

    def as_learned(self, names: Collection[str] | None = None) -> Self:
        """Return the same object with the hyperparameters in `names` learned, or with all of them learned if None.

        Values stay the same. Hyperparameters that are learned already keep their intervals.
        """

        def learned(name: str, value: float) -> float:
            is_new = (names is None or name in names) and not isinstance(value, Learned)
            return Learned(value) if is_new else value

        return self.map_values(learned)

    def as_known(self) -> Self:
        """Return the same object with every hyperparameter known at its current value."""
        return self.map_values(lambda _, value: float(value))


class Combined(Parametrized):
    """An object that consists of others with hyperparameters: those of the part `x` are called x.NAME."""

    @property
    @abstractmethod
    def named_parts(self) -> Mapping[str, Parametrized]:
        """The parts by their names, in the order of every gradient."""

    @abstractmethod
    def with_parts(self, parts: Sequence[Any]) -> Self:
        """Return the same object with other parts, in the same order."""

    def name_of(self, part: str, name: str) -> str:
        """Return the full name of a part's hyperparameter."""
        return f"{part}.{name}"

    @property
    def hyperparameters(self) -> dict[str, float]:
        parts = self.named_parts.items()
        return {self.name_of(part, name): v for part, of in parts for name, v in of.hyperparameters.items()}

    def map_values(self, change: Callable[[str, float], float]) -> Self:
        def change_in(part: str) -> Callable[[str, float], float]:
            return lambda name, value: change(self.name_of(part, name), value)

        return self.with_parts([of.map_values(change_in(part)) for part, of in self.named_parts.items()])


def amplitude(scales: Scales) -> Search:
    """Return the search interval of a signal's standard deviation.

    It has tiny values, because these may be the only ones with which a signal keeps its bounds.
    """
    size = scales.amplitude
    return Search((1e-12 * size, 1e3 * size), (0.1 * size, 10.0 * size))


def noise(scales: Scales) -> Search:
    """Return the search interval of the noise's standard deviation, in the unit of the samples."""
    size = scales.amplitude
    return Search((1e-4 * size, 1e1 * size), (1e-2 * size, size))


def duration(scales: Scales) -> Search:
    """Return the search interval of a length scale: a time [s] over which the signal changes."""
    most = 100 * scales.span
    return Search((min(max(scales.spacing / 10, scales.shortest), most), most))


def fraction_of_period(_: Scales) -> Search:
    """Return the search interval of a length scale without unit, that of a periodic kernel."""
    return Search((0.1, 10.0))


def repetition(scales: Scales) -> Search:
    """Return the search interval of a period: a time [s] after which the signal repeats.

    The longest period is the span of the samples. The shortest period contains three samples, because a period with two
    may be an alias; it is at most half the span. The likelihood has local minima in the whole interval, so searches
    start in all of it.
    """
    whole = scales.span * min(0.5, 3 / max(scales.count - 1, 1)), scales.span
    return Search(whole, whole)


def tail_weight(_: Scales) -> Search:
    """Return the search interval of the shape α of a rational quadratic kernel, which has no unit."""
    return Search((0.1, 1e4), (0.3, 30.0))


def _is_positive(given: object) -> bool:
    return is_number(given) and 0 < given < math.inf
