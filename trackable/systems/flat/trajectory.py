"""States and inputs of a reference as functions of time: formulas of functionals of the learned signals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.systems.flat.functional import Functional, Signals
from trackable.systems.flat.functional import combined as combined_functional
from trackable.systems.formulas.algebra import Maybe, derivative, plus, times
from trackable.systems.formulas.expression import Constant, Expression, Variable, at_floats, variables

_ITSELF = "q"


@dataclass(frozen=True)
class Trajectory:
    """q(t) = formula(q_1(t), …, q_k(t)), with the functionals q_i by name in `arguments`.

    Those of a linear system are functionals themselves: the formula is then the one argument, as it stands.
    """

    formula: Expression
    arguments: tuple[tuple[str, Functional], ...]

    @classmethod
    def of(cls, functional: Functional) -> Self:
        """The functional itself."""
        return cls(Variable(_ITSELF), ((_ITSELF, functional),))

    @classmethod
    def made(cls, formula: Expression, functionals: Mapping[str, Functional]) -> Self:
        """A formula of those functionals that it names."""
        held = variables(formula)
        return cls(formula, tuple((name, functional) for name, functional in functionals.items() if name in held))

    @property
    def functional(self) -> Functional | None:
        """The functional that it is; None where it is a formula of some."""
        return self.arguments[0][1] if isinstance(self.formula, Variable) else None

    @property
    def sampling_time(self) -> float:
        """T_s [s]."""
        return self.arguments[0][1].sampling_time

    def __call__(self, signals: Signals, t: Array) -> Array:
        """q at t [s], the shape of t; NaN or infinite where it is not defined."""
        return self.value({name: functional(signals, t) for name, functional in self.arguments})

    def at_rest(self, levels: Sequence[float]) -> float:
        """The value while every signal is constant; NaN or infinite where there is none."""
        return float(self.value({name: np.asarray(q.at_rest(levels)) for name, q in self.arguments}))

    def value(self, arguments: Mapping[str, Array]) -> Array:
        """The formula at these values of the arguments."""
        return at_floats(self.formula, arguments)

    def slopes(self, arguments: Mapping[str, Array]) -> dict[str, Array]:
        """∂q/∂q_i at these values of the arguments."""
        return {
            name: at_floats(slope, arguments) if slope is not None else np.zeros(())
            for name, slope in self.derivatives.items()
        }

    def weights_at(self, signals: Signals, t: Array) -> list[tuple[int, Array]]:
        """(c, w_c): small changes δz of the signals move q, at one t [s], by Σ_c Σ_j w_cj δz_c(t + j T_s)."""
        slopes = self.slopes({name: functional(signals, t) for name, functional in self.arguments})
        longest = max(len(w) for _, functional in self.arguments for w in functional.weights)
        weights = np.zeros((len(self.arguments[0][1].weights), longest))
        for name, functional in self.arguments:
            for c, rounded in functional.rounded:
                weights[c, : len(rounded)] += slopes[name].item() * rounded
        return [(c, w) for c, w in enumerate(weights) if w.any()]

    @cached_property
    def derivatives(self) -> dict[str, Maybe]:
        """∂q/∂q_i as formulas."""
        return {name: derivative(self.formula, name) for name, _ in self.arguments}

    @cached_property
    def shifts(self) -> tuple[Maybe, ...]:
        """How q moves when one signal is shifted at all times alike, for each signal, as formulas.

        What cancels in a sum of `derivatives` has cancelled here before any interval is put in. ValueError where a
        functional moves with a signal at another rate than 0 or 1.
        """
        found = []
        for c in range(len(self.arguments[0][1].weights)):
            rates = {name: sum(functional.weights[c]) for name, functional in self.arguments}
            if not set(rates.values()) <= {0, 1}:
                raise ValueError(f"trajectory: a formula needs functionals that move as signals do, got rates {rates}")
            found.append(derivative(self.formula, *(name for name, rate in rates.items() if rate)))
        return tuple(found)


Coordinate = Functional | Trajectory
"""A state or an input: of a linear system always a functional."""


def combined(row: Sequence[Fraction], coordinates: Sequence[Coordinate]) -> Trajectory:
    """Σ_i row_i q_i, of coordinates that are all of one kind; of functionals another functional, exactly."""
    functionals = [q for q in coordinates if isinstance(q, Functional)]
    if functionals:
        return Trajectory.of(combined_functional(row, functionals))
    total, arguments = None, dict[str, Functional]()
    for r, q in zip(row, coordinates, strict=True):
        if r and isinstance(q, Trajectory):
            total = plus(total, times(Constant(float(r)), q.formula))
            arguments.update(q.arguments)
    assert total is not None
    return Trajectory.made(total, arguments)
