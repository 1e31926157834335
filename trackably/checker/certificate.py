"""The content of a certificate file as typed values, from which all steps of its proof are checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import inf
from typing import Annotated, ClassVar

from trackably.checker.disturbances import Robust
from trackably.checker.limits import BOXES, CENTRES, MAY_BE_EMPTY, TERMS
from trackably.checker.subject import Numbers, Positive, Subject

FORMAT, VERSION = "trackably certificate", 3

Ends = Annotated[tuple[float, ...], BOXES + 1]
OfBoxes = Annotated[tuple[Positive, ...], BOXES]
Terms = Annotated[int, TERMS]


@dataclass(frozen=True)
class Boxes:
    """Boxes of time: box k is from ends[k] to ends[k + 1] [s], and its discs in Cauchy's estimate have radii[k] [s]."""

    ends: Ends
    radii: OfBoxes


@dataclass(frozen=True)
class AllTimes:
    """The claim about every real t ≥ 0; `span` has the first and the last claimed time [s]."""

    kind: ClassVar = "all_times"
    span = 0.0, inf

    def __str__(self) -> str:
        return "all real t ≥ 0"


@dataclass(frozen=True)
class AllPhases:
    """The claim about every real t, for signals that are periodic."""

    kind: ClassVar = "all_phases"
    span = -inf, inf

    def __str__(self) -> str:
        return "all real t"


@dataclass(frozen=True)
class Window:
    """The claim about every real t from `start` to `end` [s]."""

    start: float
    end: float
    kind: ClassVar = "window"

    @property
    def span(self) -> tuple[float, float]:
        return self.start, self.end

    def __str__(self) -> str:
        return f"all real t from {self.start!r} s to {self.end!r} s"


@dataclass(frozen=True)
class Instants:
    """The claim about every t = k T with k ≥ 0."""

    kind: ClassVar = "instants"
    span = 0.0, inf

    def __str__(self) -> str:
        return "all sampled instants t = k T, k ≥ 0"


Claim = AllTimes | AllPhases | Window | Instants
KINDS: dict[str, type[Claim]] = {of.kind: of for of in (AllTimes, AllPhases, Window, Instants)}
"""Claims by their names in files."""


@dataclass(frozen=True)
class Cover:
    """The proof of a claim about real times, with `boxes` of time for each bound, by the bound's name.

    The boxes of each bound cover the times from `start` to `end` [s]. These times are the claimed window, one period of
    all kernels, or all times up to `end`, after which the bounds hold because the kernels decay. `terms` is the number
    of terms of the Taylor polynomial in each box. Signals of polynomial pieces need no boxes.
    """

    start: float
    end: float
    boxes: Mapping[str, Boxes]
    terms: int


@dataclass(frozen=True)
class Steps:
    """The proof of a claim about instants k T: those up to k = `last` are checked one by one, later ones by decay."""

    last: int


Measurement = Annotated[int, 2 * CENTRES, 0]
"""The number of a measurement, from 0 on."""

Pair = tuple[Measurement, Measurement]
"""The numbers of two measurements from which a bound of a true signal follows (`TrueSignal`)."""

Pairs = Annotated[tuple[Pair, ...], BOXES]
WeightedMeasurements = Annotated[tuple[tuple[Measurement, Fraction], ...], CENTRES]


Place = tuple[Fraction, Fraction, Fraction]
"""A time [s], a value, and the largest distance of any signal of a class from the value at this time."""


@dataclass(frozen=True)
class Measured:
    """Measured `values` at increasing `times` [s], each with an error of at most `noise` (in the unit of values)."""

    times: Numbers
    values: Numbers
    noise: float

    @cached_property
    def places(self) -> list[Place]:
        """Time [s], value and largest error of each measurement."""
        return [(Fraction(t), Fraction(y), Fraction(self.noise)) for t, y in zip(self.times, self.values, strict=True)]


@dataclass(frozen=True)
class SignalClass:
    """All signals f that agree with `samples` of f, and with `rates` (samples of f′), up to the noise of each.

    |f′| is at most the `slope` L [1/s], or |f″| at most the `second_derivative` M [1/s²], or both.
    """

    samples: Measured
    rates: Measured | None = None
    slope: Positive | None = None
    second_derivative: Positive | None = None


@dataclass(frozen=True)
class Derived:
    """An upper and a lower bound, at a `time` [s], of all signals of a `SignalClass`, from several measurements.

    Each bound is a weighted sum of measurements, plus what their errors and the bounds of derivatives allow (module
    `truth`). `upper` and `lower` have its terms as pairs: the number of a measurement, and its weight, the multiplier.
    Numbers count the samples from 0 on, then the rates (samples of f′).
    """

    time: float
    upper: WeightedMeasurements
    lower: WeightedMeasurements


@dataclass(frozen=True)
class TrueSignal:
    """The claim that a `state` of the reference is within errors[k] of every signal of the class `of`, in each cell k.

    Cell k is from ends[k] to ends[k + 1] [s]. For each cell, `upper` and `lower` name the two measurements from
    which an upper and a lower bound of the signals follow. Their numbers count samples first, then rates, then
    `derived` (bounds at further times, each from several measurements). `radii` [s] are those of the discs in Cauchy's
    estimate, and `terms` is the number of terms of Taylor models. If `plant` is given, the state of the disturbed
    system is claimed to be within `plant` of the signal.
    """

    state: str
    of: SignalClass
    ends: Ends
    radii: OfBoxes
    terms: Terms
    upper: Pairs
    lower: Pairs
    errors: OfBoxes
    plant: float | None = None
    derived: Annotated[tuple[Derived, ...], BOXES, MAY_BE_EMPTY] = ()

    @property
    def error(self) -> float:
        """The largest of the errors of all cells."""
        return max(self.errors)


@dataclass(frozen=True)
class Certificate:
    """A claim about a reference, with its `proof` and all data needed to verify it.

    `errors` has, by the name of each bound, an upper bound of the error of float64 evaluation for |t| ≤ `until` [s].
    `robust` is the claim about the disturbed system; None without this claim. `truth` has the claims about the
    distances of states from true signals.
    """

    subject: Subject
    claim: Claim
    proof: Cover | Steps
    until: float
    errors: Mapping[str, float]
    robust: Robust | None
    truth: tuple[TrueSignal, ...] = ()
