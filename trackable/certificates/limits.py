"""Bound a reference's quantities for all times after a start, where its signals decay to their means."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache

import numpy as np
from flint import arb, arb_poly

from trackable.arrays import Array
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.formulas import UndefinedError, at_balls, require
from trackable.certificates.balls.models import Enclosure
from trackable.certificates.exact import ExactFunctional, ExactQuantity, exact_quantities, rational
from trackable.certificates.floats.balls import Balls, sums_up
from trackable.certificates.kernels.base import Decay
from trackable.certificates.kernels.table import balls_of
from trackable.certificates.rounding.flat import FormulaRounding
from trackable.gp.signal import KernelSum
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.trajectory import Trajectory
from trackable.systems.quantity import Quantity
from trackable.systems.reference import Reference

_TERMS = 4


def limits_beyond(reference: Reference, start: arb) -> dict[str, tuple[arb, arb]]:
    """Return centre and reach of an interval that contains each quantity for all real t ≥ `start` [s].

    The reach is an over-estimate, and infinite where a quantity may not be defined.

    With e = z − m: |e(t)| ≤ R = Σ |c_i| K_i and |ė(t)| ≤ D = Σ |c_i| D_i, where K_i and D_i bound |κ| and |κ̇| at all
    distances from start − t_i on. So Σ_j w_j e(t + j T_s) is at most Σ_j |w_j| R. As it equals
    Σ_j w_j e(t) + Σ_j w_j (e(t + j T_s) − e(t)), it is also at most |Σ_j w_j| R + T_s Σ_j j |w_j| D. By the mean-value
    theorem, a formula of such functionals differs from its value at rest by such a sum, whose weights are its slopes.
    """
    with ball_arithmetic(2):
        envelopes = [_envelope(signal, start) for signal in reference.kernel_sums]
        exact = exact_quantities(reference)
        every = zip(reference.quantities, exact, _weights(reference.plant), strict=True)
        return {q.name: _limits(q, e, weights, envelopes) for q, e, weights in every}


def undefined_beyond(
    reference: Reference, start: arb, reserve: Mapping[str, float], roundings: Mapping[str, FormulaRounding]
) -> set[str]:
    """Return the quantities whose rounding may exceed its reserve at some t ≥ `start` [s], or that lack what they need.

    Both happen to formulas of a flat form only: so `roundings` are of these.
    """
    found = set[str]()
    if not (roundings or reference.plant.needs):
        return found
    with ball_arithmetic(_TERMS):
        envelopes = {id(signal): _envelope(signal, start) for signal in reference.kernel_sums}
        for q in exact_quantities(reference):
            arguments = {name: _range(functional, envelopes) for name, functional in q.arguments.items()}
            rounding = roundings.get(q.name)
            try:
                require(q.needs, {name: argument.span for name, argument in arguments.items()})
                if rounding and not rounding.error(arguments) <= arb(reserve[q.name]):
                    found.add(q.name)
            except UndefinedError:
                found.add(q.name)
    return found


def _range(functional: ExactFunctional, envelopes: Mapping[int, Decay[arb]]) -> Enclosure:
    reach = sum((abs(w) * envelopes[id(shifted.signal)].size for w, shifted in functional.terms), arb(0))
    return Enclosure(arb_poly([functional.offset]), reach)


def _limits(
    quantity: Quantity, exact: ExactQuantity, weighted: Mapping[str, list["_Weights"]], envelopes: list[Decay[arb]]
) -> tuple[arb, arb]:
    trajectory, step = quantity.trajectory, arb(quantity.trajectory.sampling_time)
    reaches = {
        name: sum((_reach(w, e, step) for w, e in zip(weights, envelopes, strict=True)), arb(0))
        for name, weights in weighted.items()
    }
    rest = {name: functional.offset for name, functional in exact.arguments.items()}
    around = {name: level + arb(0, 1) * reaches[name] for name, level in rest.items()}
    try:
        if trajectory.functional:
            return at_balls(trajectory.formula, rest), at_balls(trajectory.formula, reaches)
        at_balls(trajectory.formula, around)  # raises where the formula may not be defined
        weights = zip(_formula_weights(trajectory, around), envelopes, strict=True)
        return at_balls(trajectory.formula, rest), sum((_reach(w, e, step) for w, e in weights), arb(0))
    except UndefinedError:
        return arb(0), arb.pos_inf()


@dataclass(frozen=True)
class _Weights:
    """Weights w_j of one signal, and their sum."""

    each: list[arb]
    sum: arb

    @cached_property
    def sizes(self) -> arb:
        """Σ_j |w_j|."""
        return sum((abs(w) for w in self.each), arb(0))

    @cached_property
    def shifted(self) -> arb:
        """Σ_j j |w_j|."""
        return sum((j * abs(w) for j, w in enumerate(self.each)), arb(0))


@lru_cache
def _weights(plant: ConstrainedSystem) -> list[dict[str, list[_Weights]]]:
    """Return the weights of each signal in each argument of each quantity."""
    with ball_arithmetic():
        return [
            {name: [_exact_weights(w) for w in functional.weights] for name, functional in q.trajectory.arguments}
            for q in plant.quantities
        ]


def _exact_weights(weights: tuple[Fraction, ...]) -> _Weights:
    return _Weights([rational(w) for w in weights], rational(sum(weights, Fraction(0))))


def _formula_weights(trajectory: Trajectory, around: dict[str, arb]) -> Iterator[_Weights]:
    """Yield the weights Σ_a ∂q/∂q_a w_acj of each signal c; the slopes enclose those at all values in `around`."""
    slopes = {name: at_balls(s, around) for name, s in trajectory.derivatives.items() if s is not None}
    longest = max(len(w) for _, functional in trajectory.arguments for w in functional.weights)
    for c, shift in enumerate(trajectory.level_derivatives):
        each = [arb(0)] * longest
        for name, functional in trajectory.arguments:
            for j, w in enumerate(functional.weights[c]):
                each[j] += slopes[name] * rational(w) if name in slopes else 0
        yield _Weights(each, at_balls(shift, around) if shift is not None else arb(0))


def _reach(weights: _Weights, envelope: Decay[arb], step: arb) -> arb:
    """Bound |Σ_j w_j e(t + j T_s)|."""
    size, rate = envelope
    by_size = weights.sizes * size
    by_rate = abs(weights.sum) * size + step * weights.shifted * rate
    return by_rate.min(by_size)


def _envelope(signal: KernelSum, start: arb) -> Decay[arb]:
    """Return bounds R of |z − m| and D of |ż| for all t ≥ `start`, in float64: zero where all kernels are zero."""
    with np.errstate(all="ignore"):  # what is not finite bounds nothing
        of_kernels = balls_of(signal.kernel).beyond((Balls.of(start) - signal.centres).max(0.0))
        return Decay(*(_total(np.abs(signal.weights), bounds) for bounds in of_kernels))


def _total(sizes: Array, bounds: Balls) -> arb:
    """Over-estimate Σ_i size_i |bound_i|."""
    some = ~bounds.is_zero()
    total = np.asarray(np.sum((sizes * bounds.size)[some]))
    return arb(float(sums_up(total, len(sizes)))) if np.any(some) else arb(0)
