"""States and inputs of a reference as functions of time: formulas of functionals of the learned signals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.stencil import Stencil
from trackably.systems.flat.form import named
from trackably.systems.flat.functional import Functional, Signals
from trackably.systems.flat.functional import combined as combined_functional
from trackably.systems.formulas.affine import affine_parts
from trackably.systems.formulas.algebra import Term, derivative, plus, times
from trackably.systems.formulas.evaluation import evaluate_floats
from trackably.systems.formulas.expression import Constant, Difference, Expression, Quotient, Variable, variables
from trackably.systems.formulas.substitution import substituted

_ITSELF = "q"


@dataclass(frozen=True)
class Trajectory:
    """q(t) = formula(q_1(t), …, q_k(t)), with the functionals q_i by name in `arguments`.

    For a linear system, q is a functional: the formula is then its only argument.
    """

    formula: Expression
    arguments: tuple[tuple[str, Functional], ...]

    @classmethod
    def of(cls, functional: Functional) -> Self:
        """Return the trajectory that is a functional itself."""
        return cls(Variable(_ITSELF), ((_ITSELF, functional),))

    @classmethod
    def of_formula(cls, formula: Expression, functionals: Mapping[str, Functional]) -> Self:
        """Return the trajectory of a formula, with the functionals that it names."""
        names = variables(formula)
        return cls(formula, tuple((name, functional) for name, functional in functionals.items() if name in names))

    @property
    def functional(self) -> Functional | None:
        """The functional, if the trajectory is one itself; otherwise None."""
        return self.arguments[0][1] if isinstance(self.formula, Variable) else None

    @cached_property
    def stencil(self) -> tuple[int, Stencil] | None:
        """The signal c and its weights, if q is an affine function of exactly one signal; otherwise None."""
        try:
            parts = affine_parts(self.formula, frozenset(name for name, _ in self.arguments))
        except ValueError:
            return None
        gains = {name: float(evaluate_floats(gain, {})) for name, gain in parts.gains.items()}
        signals = self._weights(gains)
        if len(signals) != 1:
            return None
        ((signal, weights),) = signals
        offset = 0.0 if parts.drift is None else float(evaluate_floats(parts.drift, {}))
        return signal, Stencil(tuple(weights.tolist()), self.sampling_time, offset)

    @property
    def sampling_time(self) -> float:
        """T_s [s]."""
        return self.arguments[0][1].sampling_time

    def __call__(self, signals: Signals, t: Array) -> Array:
        """Return q at t [s]: the shape of t; NaN or infinite where it is not defined."""
        return self.value({name: functional(signals, t) for name, functional in self.arguments})

    def at_rest(self, levels: Sequence[float]) -> float:
        """Return q while every signal c is constant at `levels[c]`; NaN or infinite if it is not defined there."""
        return float(self.value({name: np.asarray(q.at_rest(levels)) for name, q in self.arguments}))

    @property
    def rate(self) -> Self:
        """(q(t + T_s) − q(t)) / T_s; of a functional, it is again one."""
        T = Fraction(self.sampling_time)
        if (q := self.functional) is not None:
            pairs = [zip(w, (*w[1:], Fraction(0)), strict=True) for w in q.later.weights]
            return self.of(Functional(tuple(tuple((b - a) / T for b, a in of) for of in pairs), Fraction(0), float(T)))
        later = {name: f"{name}⁺" for name, _ in self.arguments}
        there = substituted(self.formula, {name: Variable(new) for name, new in later.items()})
        arguments = (*self.arguments, *((later[name], functional.later) for name, functional in self.arguments))
        return type(self)(Quotient(Difference(there, self.formula), Constant(float(T))), arguments)

    def rates_at_rest(self, levels: Sequence[float]) -> Array:
        """Return how q changes with each signal's level, per unit, while signal c is constant at `levels[c]`."""
        slopes = self.slopes({name: np.asarray(q.at_rest(levels)) for name, q in self.arguments})
        gains = ((slopes[name], [float(sum(w)) for w in q.weights]) for name, q in self.arguments)
        return np.asarray(sum(slope * np.array(gain) for slope, gain in gains))

    def value(self, arguments: Mapping[str, Array]) -> Array:
        """Evaluate the formula at these values of the arguments."""
        return evaluate_floats(self.formula, arguments)

    def slopes(self, arguments: Mapping[str, Array]) -> dict[str, Array]:
        """Return ∂q/∂q_i at these values of the arguments."""
        return {
            name: evaluate_floats(slope, arguments) if slope is not None else np.zeros(())
            for name, slope in self.derivatives.items()
        }

    def weights_at(self, signals: Signals, t: Array) -> list[tuple[int, Array]]:
        """Linearise at one t [s]: pairs (c, w_c) such that δq = Σ_c Σ_j w_cj δz_c(t + j T_s) for small changes δz."""
        slopes = self.slopes({name: functional(signals, t) for name, functional in self.arguments})
        return self._weights({name: slope.item() for name, slope in slopes.items()})

    def _weights(self, gains: Mapping[str, float]) -> list[tuple[int, Array]]:
        """Return the weights of all signals in Σ_i gains[i] q_i that are not zero."""
        longest = max(len(w) for _, functional in self.arguments for w in functional.weights)
        weights = np.zeros((len(self.arguments[0][1].weights), longest))
        for name, functional in self.arguments:
            for c, rounded in functional.rounded:
                weights[c, : len(rounded)] += gains.get(name, 0.0) * rounded
        return [(c, w) for c, w in enumerate(weights) if w.any()]

    @cached_property
    def derivatives(self) -> dict[str, Term]:
        """∂q/∂q_i as formulas, by the name of q_i."""
        return {name: derivative(self.formula, name) for name, _ in self.arguments}

    @cached_property
    def level_derivatives(self) -> tuple[Term, ...]:
        """For each signal, the derivative of q with respect to a constant added to it at all times, as a formula.

        Terms of a sum of `derivatives` that cancel have cancelled here, before any interval is inserted. ValueError: a
        functional changes with a signal at a rate other than 0 or 1.
        """
        found = []
        for c in range(len(self.arguments[0][1].weights)):
            rates = {name: sum(functional.weights[c]) for name, functional in self.arguments}
            if not set(rates.values()) <= {0, 1}:
                raise ValueError(f"trajectory: a formula needs functionals that move as signals do, got rates {rates}")
            found.append(derivative(self.formula, *(name for name, rate in rates.items() if rate)))
        return tuple(found)


def single_signal(functional: Functional) -> Trajectory:
    """Return a functional z_c(t + j T_s) as a formula, with the name that a flat form gives to it."""
    ((c, j),) = ((c, j) for c, weights in enumerate(functional.weights) for j, w in enumerate(weights) if w)
    assert (functional.weights[c][j], functional.offset) == (Fraction(1), Fraction(0)), "a single shifted signal"
    name = named(c, j)
    return Trajectory(Variable(name), ((name, functional),))


Coordinate = Functional | Trajectory
"""A state or an input as a function of time; for a linear system always a functional."""


def combined(row: Sequence[Fraction], coordinates: Sequence[Coordinate]) -> Trajectory:
    """Return Σ_i row_i q_i; of functionals, it is again a functional, exactly.

    Functionals beside formulas must be single shifted signals, as those of a flat form are.
    """
    every = list(zip(row, coordinates, strict=True))
    used = [(r, q) for r, q in every if r] or every
    functionals = [q for _, q in used if isinstance(q, Functional)]
    if len(functionals) == len(used):
        return Trajectory.of(combined_functional([r for r, _ in used], functionals))
    total, arguments = None, dict[str, Functional]()
    for r, q in used:
        part = single_signal(q) if isinstance(q, Functional) else q
        total = plus(total, times(Constant(float(r)), part.formula))
        arguments.update(part.arguments)
    assert total is not None
    return Trajectory.of_formula(total, arguments)
