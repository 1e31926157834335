"""Constraints of periodic references: at all phases, on the grid of problem (4), and those of program (8)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pipeline.published.scalar import coefficients, growth_rates, state_and_input
from trackably.arrays import Array
from trackably.checker.certificate import AllPhases, Window
from trackably.gp.joint import JointPosterior
from trackably.gp.kernels.base import Kernel
from trackably.gp.signal import KernelSum
from trackably.learning.constraint import ROUNDING_BACKOFF, Constraint
from trackably.learning.index_set import RealTimes, SeveralTimes, Steps, TimesAndMargins
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.trajectories import Quantities


@dataclass(frozen=True, eq=False)
class GrowthRates(SeveralTimes):
    """Pairs of times (t, s) in the same interval between `edges` [s], where ṁ⁺(t) is to be a growth rate of m⁺(s).

    The rate τ is a growth rate of the state x if x + τ T_s = a x + b u + c for some u ∈ U. So ṁ⁺(t) is a growth rate of
    all states x = m⁺(s) of the interval, for all t of the interval, if and only if

        (T_s ṁ⁺(t) + (1 − a) m⁺(s) − c)/b ∈ U   for all t and s of the interval.

    This is a semi-infinite constraint, smooth in θ and imposed at pairs of times (t, s), so that minima and maxima need
    not be differentiated. It is stricter than the exact input constraint, for which t = s.

    A step that begins in one interval and ends in a later one is covered by the rates of neither: a gap of the paper's
    Lemma 2. With an `overlap` of T_s [s], the rates of an interval hold until T_s after its end, so that they cover
    each step that begins in the interval: u_r(s) is the mean of the expression above over t ∈ [s, s + T_s].
    """

    plant: ConstrainedSystem
    edges: tuple[float, ...]
    overlap: float = 0.0

    @property
    def none(self) -> Array:
        return np.empty((0, 2))

    @property
    def ends(self) -> tuple[float, float]:
        return self.edges[0], self.edges[-1] + self.overlap

    def minima_of_each(self, margins: Quantities, kernels: Sequence[Kernel]) -> list[TimesAndMargins]:
        """Return the two pairs (t, s) of each interval with the least margin to the bounds of U, one for each bound."""
        (signal,), (a, b, _) = margins.signals, self._coefficients
        assert isinstance(signal, KernelSum)
        slowest, fastest = _extremes(signal, self.edges, order=1, sign=1 / b, overlap=self.overlap)
        lowest, highest = _extremes(signal, self.edges, order=0, sign=(1 - a) / b)
        pairs = np.concatenate([np.column_stack([slowest, lowest]), np.column_stack([fastest, highest])])
        return [(pairs, of.bounds.margin(self.value(signal, pairs))) for of in margins.quantities]

    def value(self, signal: KernelSum, places: Array) -> Array:
        """Return the quantity at n pairs (t, s): shape (n,)."""
        t, s = places.T
        return self._combined(signal.derivative(t), signal(s)) - self._offset

    def value_and_gradient(self, posterior: JointPosterior, places: Array) -> tuple[Array, Array]:
        jets = posterior.jets(0, places.T, 1)
        value, *gradient = self._combined(jets[:, 1, 0], jets[:, 0, 1])
        return value - self._offset, np.array(gradient)

    def _combined(self, rate: Array, state: Array) -> Array:
        a, b, _ = self._coefficients
        return np.asarray((self.plant.sampling_time * rate + (1 - a) * state) / b)

    @property
    def _offset(self) -> float:
        _, b, c = self._coefficients
        return c / b

    @cached_property
    def _coefficients(self) -> tuple[float, float, float]:
        return coefficients(self.plant)


def interval_growth_rates(signal: KernelSum, plant: ConstrainedSystem, edges: tuple[float, ...]) -> tuple[Array, Array]:
    """Return [τ_low, τ_high] per second on each of the η intervals between `edges` [s], for all states there.

    Shapes (η,). Raises ValueError for systems that are not scalar.
    """
    lowest, highest = _extremes(signal, edges, order=0, sign=1.0)
    states = zip(signal(lowest).tolist(), signal(highest).tolist(), strict=True)
    rates = np.array([growth_rates(plant, Interval(low, high)) for low, high in states])
    return rates[:, 0], rates[:, 1]


class Values(Quantities):
    """The values of a function of time, its only signal, in place of margins: to find their local minima."""

    def margins(self, t: Array) -> Array:
        return self.signals[0](t)[None]


def _extremes(
    signal: KernelSum, edges: tuple[float, ...], order: int, sign: float, overlap: float = 0.0
) -> tuple[Array, Array]:
    """Return the times of the least and the largest sign · m⁺⁽ᵒʳᵈᵉʳ⁾ in each interval, prolonged by `overlap` [s]."""

    def derivative(t: Array) -> Array:
        return np.asarray(sign * signal.jet(t, order)[order])

    starts, ends = np.array(edges[:-1]), np.array(edges[1:]) + overlap
    window = RealTimes(Window(starts[0], ends[-1]))
    signs = [Values((), (f,)) for f in (derivative, lambda t: -derivative(t))]
    turns = [window.minima_of_each(values, [signal.kernel])[0][0] for values in signs]
    times = np.unique(np.concatenate([*turns, starts, ends]))
    values = derivative(times)
    inside = [slice(first, last + 1) for first, last in np.searchsorted(times, np.column_stack([starts, ends]))]
    smallest = [times[i][np.argmin(values[i])] for i in inside]
    return np.array(smallest), np.array([times[i][np.argmax(values[i])] for i in inside])


def on_grid(plant: ConstrainedSystem, last_step: int, spacing: float | None = None) -> tuple[Constraint, Constraint]:
    """Constrain the state at steps 0 … k̄ and the input at the steps before k̄ = `last_step` ≥ T_p/T_s: problem (4).

    The paper's closing remark prefers this to (8). If the period is no multiple of T_s, nothing is proved for k > k̄. If
    it is k̄ T_s, these are all instants that ever occur. Instants have a `spacing` [s], which is T_s by default. Raises
    ValueError for systems that are not scalar.
    """
    state, input_ = state_and_input(plant)
    step = spacing or plant.sampling_time
    return Constraint(state, Steps(0, last_step, step)), Constraint(input_, Steps(0, last_step - 1, step))


def on_intervals(
    plant: ConstrainedSystem, last_step: int, count: int, backoff: float = ROUNDING_BACKOFF, overlap: float = 0.0
) -> tuple[Constraint, Constraint]:
    """Return the constraints of program (8) on [0, k̄ T_s] with η = `count` intervals and k̄ = `last_step` ≥ T_p/T_s.

    As printed it does not cover steps from one interval into the next. That is harmless for 0 ≤ a ≤ 1 only. Growth
    rates that hold T_s [s] beyond each interval, its `overlap`, close this gap of the paper's Lemma 2 for every a: each
    step is within the rates of the interval in which it begins. Raises ValueError for systems that are not scalar.
    """
    end = last_step * plant.sampling_time
    edges = tuple(np.linspace(0.0, end, count + 1).tolist())
    state, input_ = state_and_input(plant)
    of_state = Constraint(state, RealTimes(Window(0.0, end)), backoff)
    return of_state, Constraint(input_, GrowthRates(plant, edges, overlap), backoff)


def all_phases(plant: ConstrainedSystem, backoff: float = ROUNDING_BACKOFF) -> tuple[Constraint, ...]:
    """Constrain every bounded quantity at all phases of the period, so that x_r(t) ∈ X and u_r(t) ∈ U for every t."""
    return tuple(Constraint(quantity, RealTimes(AllPhases()), backoff) for quantity in plant.quantities)
