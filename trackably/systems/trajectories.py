"""States and inputs of a reference as functions of time, and the bounded quantities that they form."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import zip_longest
from typing import Self

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array
from trackably.checker import subject
from trackably.checker.flatness import substitute
from trackably.checker.formulas import Formula, Name, Number, names
from trackably.checker.inverse import plus, times
from trackably.checker.quantities import weighted_sum as sum_of_functionals
from trackably.checker.subject import Side
from trackably.gp.stencil import Stencil
from trackably.systems.formulas import evaluate_floats, slopes_in_floats
from trackably.systems.intervals import Interval

# Functionals: exact weighted sums of the learned signals at shifted times, plus a constant.

Signals = Sequence[Callable[[Array], Array]]
"""The learned signals as functions of time [s]."""


@dataclass(frozen=True)
class Functional(subject.Functional):
    """q(t) = offset + Σ_c Σ_j w_cj z_c(t + j T_s), with `weights[c][j]` = w_cj and T_s = `sampling_time` [s].

    z_c are the signals. Offset and weights are exact rationals. As q is affine in the signals, its derivatives, in time
    and with respect to hyperparameters, are those of the signals, summed with the same weights.
    """

    sampling_time: float

    @cached_property
    def rounded(self) -> list[tuple[int, Array]]:
        """Pairs (c, w_c) for each signal c with a nonzero weight; w_c[j] is the float64 weight of z_c(t + j T_s)."""
        found = (np.array([float(w) for w in weights]) for weights in self.weights)
        return [(c, w) for c, w in enumerate(found) if w.any()]

    def at_rest(self, levels: Sequence[float]) -> float:
        """Return the value of q if every signal z_c is constant at `levels[c]`."""
        return float(self.offset + sum(sum(w) * Fraction(m) for w, m in zip(self.weights, levels, strict=True)))

    def padded(self, before: int, after: int) -> Self:
        """Return q(t + `before` T_s), with `after` further weights, all zero, behind the last one."""
        none = [Fraction(0)]
        return replace(self, weights=tuple((*none * before, *of, *none * after) for of in self.weights))


Indices = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Functionals:
    """Functionals of the same signals: each signal is evaluated once, at all shifted times that a functional needs."""

    functionals: tuple[Functional, ...]

    def __call__(self, signals: Signals, t: Array) -> Array:
        """Return all F functionals at t [s]; the result has shape (F, *t.shape)."""
        found = self._offsets.reshape(-1, *(1,) * t.ndim) + np.zeros(t.shape)
        for c, shifts, weights in self.weights:
            step = self.functionals[0].sampling_time
            shifted = signals[c](t + (shifts * step).reshape(-1, *(1,) * t.ndim))
            summed = weights @ shifted.reshape(len(shifts), -1)
            found = found + summed.reshape(len(weights), *shifted.shape[1:])  # of many signals at once too
        return found

    def combined(self, gains: Array) -> list[tuple[int, Array]]:
        """Return Σ_i gains[i] q_i of the functionals q_i as pairs (c, w_c) of a signal's index and nonzero weights."""
        found = []
        for c, shifts, weights in self.weights:
            w = np.zeros(shifts[-1] + 1)
            w[shifts] = gains @ weights
            if w.any():
                found.append((c, w))
        return found

    @cached_property
    def _offsets(self) -> Array:
        return np.array([float(q.offset) for q in self.functionals])

    @cached_property
    def weights(self) -> list[tuple[int, Indices, Array]]:
        """For each signal c with a nonzero weight: c, the J shifts that F functionals need, and the weights (F, J)."""
        found = []
        for c, every in enumerate(zip(*(q.weights for q in self.functionals), strict=True)):
            weights = np.array([*zip(*zip_longest(*every, fillvalue=0), strict=True)], dtype=float)
            (shifts,) = np.nonzero(np.any(weights, axis=0))
            if shifts.size:
                found.append((c, shifts, weights[:, shifts]))
        return found


# States and inputs of a reference as functions of time: formulas of functionals of the learned signals.

_ITSELF = Name("q")


@dataclass(frozen=True)
class Trajectory:
    """A state, an input, or a sum of them: q(t) = formula(q_1(t), …, q_k(t)), with functionals q_i in `arguments`.

    Arguments are pairs of a name and a functional. For a linear system, q is itself a functional; the formula is then
    the name of its only argument.
    """

    formula: Formula
    arguments: tuple[tuple[str, Functional], ...]

    @classmethod
    def of(cls, functional: Functional) -> Self:
        """Return the trajectory that equals a functional (an affine sum of signals at shifted times)."""
        return cls(_ITSELF, ((_ITSELF.name, functional),))

    @classmethod
    def of_formula(cls, formula: Formula, functionals: Mapping[str, Functional]) -> Self:
        """Return the trajectory of a formula of functionals; `functionals` has them by the names in the formula."""
        used = names(formula)
        return cls(formula, tuple((name, functional) for name, functional in functionals.items() if name in used))

    @property
    def functional(self) -> Functional | None:
        """q as a functional (an affine sum of signals at shifted times); None if q is a formula of functionals."""
        return self.arguments[0][1] if isinstance(self.formula, Name) else None

    @cached_property
    def stencil(self) -> tuple[int, Stencil] | None:
        """The index c, and weights and offset, if q(t) = offset + Σ_j w_j z_c(t + j T_s) for one signal z_c.

        None if q depends on several signals, or on one in a nonlinear way.
        """
        slopes = self.slopes({name: np.array(np.nan) for name, _ in self.arguments})
        gains = np.array([slopes[name] for name, _ in self.arguments])
        if not np.isfinite(gains).all():  # a slope that depends on an argument is NaN if the argument is
            return None
        signals = self._functionals.combined(gains)
        if len(signals) != 1:
            return None
        ((signal, weights),) = signals
        at_zero = self.at_rest([0.0] * len(self.arguments[0][1].weights))
        return signal, Stencil(tuple(weights.tolist()), self.sampling_time, at_zero)

    @property
    def sampling_time(self) -> float:
        """The sampling time T_s [s]."""
        return self.arguments[0][1].sampling_time

    def __call__(self, signals: Signals, t: Array) -> Array:
        """Return q at t [s]; an array of the same shape as t, NaN or infinite where q is undefined."""
        return self.value(self.arguments_at(signals, t))

    def arguments_at(self, signals: Signals, t: Array) -> dict[str, Array]:
        """Return the values of the arguments q_i at t [s], by name."""
        values = self._functionals(signals, np.asarray(t, dtype=float))
        return dict(zip((name for name, _ in self.arguments), values, strict=True))

    @cached_property
    def _functionals(self) -> Functionals:
        return Functionals(tuple(functional for _, functional in self.arguments))

    def at_rest(self, levels: Sequence[float]) -> float:
        """Return q if every signal c is constant at `levels[c]`; NaN or infinite if it is undefined there."""
        return float(self.value({name: np.asarray(q.at_rest(levels)) for name, q in self.arguments}))

    @property
    def rate(self) -> "Trajectory":
        """The trajectory of the rate (q(t + T_s) − q(t)) / T_s; a functional if q is a functional."""
        names = {name: f"{name}⁺" for name, _ in self.arguments}
        (formula,) = substitute([self.formula], {name: Name(later) for name, later in names.items()})
        later = Trajectory(formula, tuple((names[name], q.padded(1, 0)) for name, q in self.arguments))
        now = Trajectory(self.formula, tuple((name, q.padded(0, 1)) for name, q in self.arguments))
        T = Fraction(self.sampling_time)
        return weighted_sum([1 / T, -1 / T], [later, now])

    def rates_at_rest(self, levels: Sequence[float]) -> Array:
        """Return the derivatives ∂q/∂levels[c], if every signal c is constant at `levels[c]`; one number for each."""
        slopes = self.slopes({name: np.asarray(q.at_rest(levels)) for name, q in self.arguments})
        gains = ((slopes[name], [float(sum(w)) for w in q.weights]) for name, q in self.arguments)
        return np.asarray(sum(slope * np.array(gain) for slope, gain in gains))

    def value(self, arguments: Mapping[str, Array]) -> Array:
        """Evaluate the formula of q at these values of its arguments q_i, by name."""
        return evaluate_floats(self.formula, arguments)

    def slopes(self, arguments: Mapping[str, Array]) -> dict[str, Array]:
        """Return the derivatives ∂q/∂q_i at these values of the arguments q_i, by name."""
        return slopes_in_floats(self.formula, arguments)


def weighted_sum(row: Sequence[Fraction], coordinates: Sequence[Trajectory]) -> Trajectory:
    """Return Σ_i row_i q_i of the `coordinates` q_i; if all q_i are functionals, the sum is exactly a functional.

    Otherwise, arguments of equal names in several q_i have to be equal functionals.
    """
    used = [(r, q) for r, q in zip(row, coordinates, strict=True) if r] or [(Fraction(0), coordinates[0])]
    functionals = [q.functional for _, q in used if q.functional]
    if len(functionals) == len(used):
        found = sum_of_functionals([r for r, _ in used], functionals)
        return Trajectory.of(Functional(found.offset, found.weights, functionals[0].sampling_time))
    total, arguments = None, dict[str, Functional]()
    for r, q in used:
        total = plus(total, times(Number(float(r)), q.formula))
        arguments.update(q.arguments)
    assert total is not None
    return Trajectory.of_formula(total, arguments)


# A bounded quantity of a reference: a state, an input, or a weighted sum of either.


@dataclass(frozen=True)
class Quantity(Trajectory):
    """A trajectory q = Σ_i `row`[i] v_i that must stay in `bounds`; v are the states or the inputs, as `side` says."""

    name: str
    side: Side
    row: tuple[Fraction, ...]
    bounds: Interval

    def margin(self, signals: Signals, t: Array) -> Array:
        """Return the distance to the nearer bound at t [s]; negative outside, −∞ where the value is undefined."""
        return np.asarray(Quantities((self,), signals).margins(np.asarray(t))[0])

    def is_kept_at_rest(self, levels: Sequence[float]) -> bool:
        """Whether the value lies strictly inside the final bounds if every signal c is constant at `levels[c]`."""
        return self.bounds.rest.strictly_contains(self.at_rest(levels))


# Evaluate several quantities of the same signals together: each signal once, at all times that a quantity needs.


@dataclass(frozen=True, eq=False)
class Quantities:
    """Bounded `quantities` of the same `signals`, all evaluated together."""

    quantities: tuple[Quantity, ...]
    signals: Signals

    def values(self, t: Array) -> Array:
        """Return all quantities at t [s]; the result has shape (Q, *t.shape)."""
        arguments = self._arguments
        known = dict(zip(map(id, arguments.functionals), arguments(self.signals, t), strict=True))
        return np.stack([q.value({name: known[id(of)] for name, of in q.arguments}) for q in self.quantities])

    def margins(self, t: Array) -> Array:
        """Return the distances to the nearer bounds at t [s]; the result has shape (Q, *t.shape).

        They are negative outside, and −∞ where a value is undefined.
        """
        pairs = zip(self.quantities, self.values(t), strict=True)
        margins = np.stack([quantity.bounds.margin(values, t) for quantity, values in pairs])
        return np.where(np.isnan(margins), -np.inf, margins)

    def margins_of(self, which: Indices, t: Array) -> Array:
        """Return the margin of quantity `which[i]` at t[..., i] [s], for indices (m,) and times (…, m): t's shape."""
        margins = self.margins(t)
        return np.asarray(np.take_along_axis(margins, np.broadcast_to(which, t.shape)[None], axis=0)[0])

    def breakpoints_in(self, start: float, end: float) -> Array:
        """Return the times between `start` and `end` [s] at which some bound may jump or have a kink."""
        found = (quantity.bounds.breakpoints_in(start, end) for quantity in self.quantities)
        return np.unique(np.concatenate([np.empty(0), *found]))

    @cached_property
    def _arguments(self) -> Functionals:
        """The functionals on which the quantities depend; each appears once, however many quantities use it."""
        every = {id(of): of for quantity in self.quantities for _, of in quantity.arguments}
        return Functionals(tuple(every.values()))
