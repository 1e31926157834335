"""The content of a certificate as typed values, on which everything after reading works."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import inf

from trackably.checker.disturbances import Robust
from trackably.checker.subject import Subject

FORMAT, VERSION = "trackably certificate", 3


@dataclass(frozen=True)
class Boxes:
    """Boxes of time from ends_k to ends_(k+1) [s], and for each the radius [s] of the discs in Cauchy's estimate."""

    ends: tuple[float, ...]
    radii: tuple[float, ...]


@dataclass(frozen=True)
class AllTimes:
    """Every real t ≥ 0. The `span` of a claim is its first and its last time [s]."""

    span = 0.0, inf

    def __str__(self) -> str:
        return "all real t ≥ 0"


@dataclass(frozen=True)
class AllPhases:
    """Every real t, of signals that repeat for ever."""

    span = -inf, inf

    def __str__(self) -> str:
        return "all real t"


@dataclass(frozen=True)
class Window:
    """Every real t from `start` to `end` [s]."""

    start: float
    end: float

    @property
    def span(self) -> tuple[float, float]:
        return self.start, self.end

    def __str__(self) -> str:
        return f"all real t from {self.start!r} s to {self.end!r} s"


@dataclass(frozen=True)
class Instants:
    """Every t = k T with k ≥ 0."""

    span = 0.0, inf

    def __str__(self) -> str:
        return "all sampled instants t = k T, k ≥ 0"


Claim = AllTimes | AllPhases | Window | Instants
KINDS: dict[str, type[Claim]] = {
    "all_times": AllTimes,
    "all_phases": AllPhases,
    "window": Window,
    "instants": Instants,
}
"""Names of claims in files."""


@dataclass(frozen=True)
class Cover:
    """The proof of a claim about real times, with `boxes` of time for each bound, by its name.

    The boxes lead from `start` to `end` [s]. These are the ends of the window, of one period of all kernels, or of the
    times before the tail, in which the decay of the kernels keeps the bounds. `terms` is the number of terms of a
    Taylor polynomial. Polynomial pieces have no boxes.
    """

    start: float
    end: float
    boxes: Mapping[str, Boxes]
    terms: int


@dataclass(frozen=True)
class Steps:
    """The proof of a claim about instants: steps up to `last` one by one, later ones by the decay of the kernels."""

    last: int


Pair = tuple[int, int]


@dataclass(frozen=True)
class Measured:
    """Measured `values` at increasing `times` [s], each with an error of at most `noise`."""

    times: tuple[float, ...]
    values: tuple[float, ...]
    noise: float


@dataclass(frozen=True)
class SignalClass:
    """All signals f that explain `samples` of f and `rates`, samples of f′, up to their noise.

    |f′| is at most the `slope` L [1/s], or |f″| at most the `second_derivative` M [1/s²], or both.
    """

    samples: Measured
    rates: Measured | None = None
    slope: float | None = None
    second_derivative: float | None = None


@dataclass(frozen=True)
class Derived:
    """Bounds of all signals of a class at a `time` [s] that follow from several measurements (`truth`).

    `upper` and `lower` are pairs of the number of a measurement and its multiplier. Samples are numbered from 0 on, and
    rates after them.
    """

    time: float
    upper: tuple[tuple[int, Fraction], ...]
    lower: tuple[tuple[int, Fraction], ...]


@dataclass(frozen=True)
class TrueSignal:
    """The claim that a `state` of the reference is within errors[k] of every signal of the class `of`, in each cell k.

    Cell k is from ends[k] to ends[k + 1] [s]. `upper` and `lower` give the numbers of two measurements for each cell:
    samples come first, then rates, then `derived` points. `radii` [s] are those of the discs in Cauchy's estimate, and
    `terms` is the number of terms of Taylor models. `plant` is δ, within which the state of a disturbed system is.
    """

    state: str
    of: SignalClass
    ends: tuple[float, ...]
    radii: tuple[float, ...]
    terms: int
    upper: tuple[Pair, ...]
    lower: tuple[Pair, ...]
    errors: tuple[float, ...]
    plant: float | None = None
    derived: tuple[Derived, ...] = ()

    @property
    def error(self) -> float:
        """The largest of the errors of all cells."""
        return max(self.errors)


@dataclass(frozen=True)
class Certificate:
    """A claim about a reference, with its `proof` and all data needed to verify it.

    `errors` are those of float64 evaluation up to the time `until` [s], by the name of the bound. `robust` is the
    statement about the disturbed system, and `truth` about the distances of states from true signals.
    """

    subject: Subject
    claim: Claim
    proof: Cover | Steps
    until: float
    errors: Mapping[str, float]
    robust: Robust | None
    truth: tuple[TrueSignal, ...] = ()
