"""What a file is about, its subject, as typed values: a reference, its system and its sets."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from math import frexp
from typing import Annotated, Literal

from trackably.checker.formulas import Formula
from trackably.checker.formulas import names as names_in
from trackably.checker.intervals import UNIT, Real, exactly
from trackably.checker.kernels import Decay, Kernel, Reach, reach
from trackably.checker.limits import CENTRES, COORDINATES, SHIFTS, SIGNALS
from trackably.checker.watch import UndecidedError, tick

# The types of fields say how files are read (`form.reader_of`): the annotation of a list is its largest length.

Positive = Annotated[float, "positive"]
Numbers = Annotated[tuple[float, ...], CENTRES]
Names = Annotated[tuple[str, ...], COORDINATES]
Formulas = Annotated[tuple[Formula, ...], COORDINATES]
FloatVector = Annotated[Sequence[float], COORDINATES]
Matrix = Annotated[Sequence[FloatVector], COORDINATES]

Beyond = Literal["rest", "period", "end"]


@dataclass(frozen=True)
class Pieces:
    """z(t) = Σ_j c_ij (t − t_i)^j for t_i ≤ t < t_(i+1), with `breakpoints` t_0 … t_n [s] and `coefficients` c_ij.

    `beyond` defines z at other times. "rest": z(t_0) before t_0, and the limit of z at t_n from t_n on. "period": z
    repeats every t_n − t_0. "end": the first and the last piece are continued, but nothing is claimed there.
    """

    breakpoints: tuple[float, ...]
    coefficients: tuple[tuple[float, ...], ...]
    beyond: Beyond

    @cached_property
    def ends(self) -> list[Fraction]:
        """The breakpoints, exactly."""
        return [Fraction(t) for t in self.breakpoints]

    @cached_property
    def period(self) -> Fraction:
        """The time from the first to the last breakpoint [s]."""
        return self.ends[-1] - self.ends[0]

    @cached_property
    def lengths(self) -> list[Fraction]:
        """The lengths of the pieces [s]."""
        return [end - start for start, end in pairwise(self.ends)]

    @property
    def degree(self) -> int:
        """The degree of the pieces."""
        return len(self.coefficients[0]) - 1


_NEGLIGIBLE = 2.0**-60
"""A kernel counts as far from a time at which |κ| ≤ κ(0) times this number; the errors of evaluation are larger."""


@dataclass(frozen=True)
class Signal:
    """z(t) = m + Σ_i c_i κ(t − t_i) with `mean` m, `centres` t_i [s] and `weights` c_i."""

    kernel: Kernel
    mean: float
    centres: Numbers
    weights: Numbers

    @cached_property
    def pairs(self) -> list[tuple[Real, Real]]:
        """All pairs (t_i, c_i) of a centre [s] and its weight, as intervals."""
        return [(exactly(t), exactly(c)) for t, c in zip(self.centres, self.weights, strict=True)]

    @cached_property
    def reach(self) -> Reach:
        """The distance [s] beyond which kernels count as far, and upper bounds of |κ| and |κ̇| there."""
        # The span is rounded up to a power of two, so that many signals with the same kernel share one result.
        _, exponent = frexp(max(self.centres) - min(self.centres))
        return reach(self.kernel, 2.0 ** min(exponent, 1000), _NEGLIGIBLE)

    @cached_property
    def weight(self) -> Real:
        """An over-estimate of Σ_i |c_i|: added in float64, with at most n roundings for n numbers."""
        return (1 + 2 * len(self.weights) * UNIT) * sum(map(abs, self.weights))

    @cached_property
    def far(self) -> Decay:
        """Over-estimates of |Σ_i c_i κ(r_i)| and |Σ_i c_i κ̇(r_i)|, if all distances |r_i| are beyond the reach.

        The sums may be over all kernels of the signal, or over some of them.
        """
        _, (size, slope) = self.reach
        return Decay(self.weight * size, self.weight * slope)


@dataclass(frozen=True)
class Vertex:
    """x⁺ = A x + B u + c, with A and B row by row: a linear system, or a vertex of the convex hull of systems."""

    A: Matrix
    B: Matrix
    c: FloatVector

    @cached_property
    def exact(self) -> tuple[list[list[Fraction]], list[list[Fraction]], list[Fraction]]:
        """A, B and c in rational numbers."""
        A, B = ([[*map(Fraction, row)] for row in matrix] for matrix in (self.A, self.B))
        return A, B, [*map(Fraction, self.c)]

    @cached_property
    def columns(self) -> list[Sequence[Fraction]]:
        """The columns of A and of B, and c, in rational numbers."""
        A, B, c = self.exact
        return [*zip(*A, strict=True), *zip(*B, strict=True), c]

    def fits(self, n: int, m: int) -> bool:
        """Whether A, B and c have the shapes that n states and m inputs need."""
        return [[len(row) for row in matrix] for matrix in (self.A, self.B, [self.c])] == [[n] * n, [m] * n, [n]]


@dataclass(frozen=True)
class LinearSystem(Vertex):
    """x⁺ = A x + B u + c, one `sampling_time` [s] later, with names of states and inputs."""

    states: Names
    inputs: Names
    sampling_time: Positive


@dataclass(frozen=True)
class FlatForm:
    """States and inputs as formulas of z_s(t + j T), which are called z1[0], z1[1], …, z2[0], …

    States in `angles` follow f up to multiples of 2π. Formulas in `positive` are claimed to be positive.
    """

    states: Formulas
    inputs: Formulas
    angles: Names = ()
    positive: Formulas = ()

    @property
    def indices(self) -> set[tuple[int, int]]:
        """All pairs of s and j of shifted signals on which states and inputs depend."""
        return {indices(name) for formula in (*self.states, *self.inputs) for name in names_in(formula)}

    @property
    def last_shift(self) -> int:
        """The largest j of the shifted signals z_s(t + j T) on which states and inputs depend."""
        return max(j for _, j in self.indices)


def shifted_name(s: int, j: int) -> str:
    """Return the name of z_s(t + j T), where s counts from 0."""
    return f"z{s + 1}[{j}]"


def indices(name: str) -> tuple[int, int]:
    """Return s and j of a name such as z1[0]. Raise ValueError for other names."""
    found = re.fullmatch(r"z([1-9][0-9]?)\[(0|[1-9][0-9]?)\]", name)
    if not found:
        raise ValueError(name)
    return int(found[1]) - 1, int(found[2])


@dataclass(frozen=True)
class NonlinearSystem:
    """x⁺ = f(x, u), one formula `f` for each state; states and inputs may be given by a flat form."""

    f: Formulas
    states: Names
    inputs: Names
    sampling_time: Positive
    flat: FlatForm | None = None

    @property
    def successors(self) -> tuple[str, ...]:
        """The names of the states one step later."""
        return tuple(f"{name}⁺" for name in self.states)

    @property
    def last_shift(self) -> int:
        """The largest j of the shifted signals z_s(t + j T) on which states and inputs depend."""
        return 1 if self.flat is None else self.flat.last_shift


System = LinearSystem | NonlinearSystem
Side = Literal["state", "input"]


End = float | Pieces
"""An end of a bound: a number, or polynomial pieces if the end moves in time."""


@dataclass(frozen=True)
class Row:
    """The bounds low ≤ Σ_i r_i v_i ≤ high of states or inputs v, with `row` r."""

    row: tuple[Fraction, ...]
    low: End
    high: End

    @property
    def moves(self) -> bool:
        """Whether the lower or the upper end moves in time."""
        return isinstance(self.low, Pieces) or isinstance(self.high, Pieces)

    @cached_property
    def ends(self) -> tuple[Fraction, Fraction]:
        """The lower and the upper end if both are constant. Raise UndecidedError if one of them moves."""
        if isinstance(self.low, Pieces) or isinstance(self.high, Pieces):
            raise UndecidedError(
                "not decided: a bound moves in time, but tables and redundant inputs take constant bounds only"
            )
        return Fraction(self.low), Fraction(self.high)


@dataclass(frozen=True)
class Polytope:
    """All vectors of a `dimension` that keep the bounds of all `rows`."""

    rows: tuple[Row, ...]
    dimension: int


def single_bounds(bounded: Polytope) -> Iterator[tuple[int, Fraction, Fraction]]:
    """Yield the index of each coordinate that a row bounds alone, and its bounds; rows that move are left out."""
    for row in bounded.rows:
        tick()
        used = [(j, r) for j, r in enumerate(row.row) if r]
        if len(used) == 1 and not row.moves:
            ((j, r),) = used
            low, high = sorted(end / r for end in row.ends)
            yield j, low, high


@dataclass(frozen=True)
class Plant:
    """A system, with the sets that bound its states and its inputs."""

    system: System
    state_set: Polytope
    input_set: Polytope

    @property
    def sides(self) -> tuple[tuple[tuple[str, ...], Polytope], ...]:
        """The names of the states and the state set, then the names of the inputs and the input set."""
        return (self.system.states, self.state_set), (self.system.inputs, self.input_set)


@dataclass(frozen=True)
class Functional:
    """A weighted sum of shifted signals: offset + Σ_s Σ_j w_sj z_s(t + j T) with `weights[s][j]` = w_sj."""

    offset: Fraction
    weights: Annotated[tuple[Annotated[tuple[Fraction, ...], SHIFTS], ...], SIGNALS]


Functionals = Annotated[tuple[Functional, ...], COORDINATES]


@dataclass(frozen=True)
class Trajectories:
    """States and inputs of a linear system as weighted sums of the signals."""

    states: Functionals
    inputs: Functionals


@dataclass(frozen=True)
class Bound(Row):
    """A row of states or of inputs (`of` says which) that is proved to stay between its ends; `names` are theirs."""

    name: str
    of: Side
    names: tuple[str, ...]


@dataclass(frozen=True)
class Subject(Plant):
    """A reference (signals and a system) with the sets that bound it.

    Signals are sums of kernels, or polynomial `pieces`.

    `trajectories` are given for linear systems only. `attainable` rows are given only if inputs are redundant; they
    bound u in place of the input set. The `fingerprint` is a SHA-256 of signals, system and trajectories (`form`).
    """

    signals: tuple[Signal, ...]
    trajectories: Trajectories | None
    attainable: tuple[Row, ...] | None
    fingerprint: str
    pieces: tuple[Pieces, ...] = ()

    @cached_property
    def shifts(self) -> list[int]:
        """For each signal, the number of its shifts j T, j = 0, 1, …, on which states and inputs may depend."""
        if isinstance(self.system, NonlinearSystem):
            return [1 + self.system.last_shift] * len(self.signals)
        assert self.trajectories is not None, "linear systems have them"
        state, control = self.trajectories.states[0], self.trajectories.inputs[0]
        return [max(map(len, of)) for of in zip(state.weights, control.weights, strict=True)]

    @property
    def signal_count(self) -> int:
        """The number of signals, of either kind."""
        return len(self.signals) + len(self.pieces)

    @property
    def step(self) -> Real:
        """The sampling time T [s]."""
        return exactly(self.system.sampling_time)

    @cached_property
    def bounds(self) -> tuple[Bound, ...]:
        """The rows of the state set, then those of the input set, or the attainable rows in their place."""
        inputs = self.input_set.rows if self.attainable is None else self.attainable
        sides: tuple[tuple[Side, tuple[str, ...], tuple[Row, ...]], ...] = (
            ("state", self.system.states, self.state_set.rows),
            ("input", self.system.inputs, inputs),
        )
        every = [
            Bound(row.row, row.low, row.high, sum_name(row.row, names), of, names)
            for of, names, rows in sides
            for row in rows
        ]
        called = numbered(bound.name for bound in every)
        return tuple(replace(bound, name=name) for bound, name in zip(every, called, strict=True))


def sum_name(row: Sequence[Fraction], names: Sequence[str]) -> str:
    """Return the name of a weighted sum, such as x, x+y or x-0.5y; 80 characters at most."""
    text = weighted_sum_text(row, names)
    return text if len(text) <= 80 else f"{text[:79]}…"


def weighted_sum_text(row: Sequence[Fraction], names: Sequence[str], digits: int = 3) -> str:
    """Return a weighted sum as text, with this number of significant digits of each weight."""
    signed = []
    for weight, name in zip(row, names, strict=True):
        size = as_float(abs(weight))
        if size:
            factor = "" if size == 1 else f"{size:.{digits}g}"
            signed.append(f"{'-' if weight < 0 else '+'}{factor}{name}")
    return "".join(signed).removeprefix("+")


def numbered(names: Iterable[str]) -> Iterator[str]:
    """Yield the names, with a number after each repetition: x, y, x (2)."""
    counted: dict[str, int] = {}
    for name in names:
        counted[name] = counted.get(name, 0) + 1
        yield name if counted[name] == 1 else f"{name} ({counted[name]})"


def as_float(number: Fraction) -> float:
    """Return the float64 nearest to a number; ±infinity if the number is beyond the largest float64."""
    try:
        return float(number)
    except OverflowError:
        return float("inf") if number > 0 else -float("inf")
