"""Reachable tubes and growth rates, which the paper defines for scalar systems x(k+1) = a x(k) + b u(k) + c only."""

import numpy as np

from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.trajectories import Quantity


def scalar(
    a: float, b: float, c: float = 0.0, *, state_set: Interval, input_set: Interval, sampling_time: float
) -> ConstrainedSystem:
    """Return the system x(k+1) = a x(k) + b u(k) + c with x ∈ X and u ∈ U. ValueError: b = 0, or an empty interior."""
    x, u = (Polytope.box(np.array([s.lower]), np.array([s.upper])) for s in (state_set, input_set))
    return ConstrainedSystem(LinearSystem.scalar(a, b, c, sampling_time=sampling_time), x, u)


def is_scalar(plant: ConstrainedSystem) -> bool:
    """Whether the system is linear with one state and one input, each in one interval of its own."""
    sets = plant.state_set, plant.input_set
    return isinstance(plant.system, LinearSystem) and all(np.array_equal(bounds.rows, [[1.0]]) for bounds in sets)


def state_and_input(plant: ConstrainedSystem) -> tuple[Quantity, Quantity]:
    """Return the state and the input of a scalar system. ValueError: another system, or one of them is not bounded."""
    _refuse_others(plant)
    state, input_ = plant.quantities
    return state, input_


def interval_sets(plant: ConstrainedSystem) -> tuple[Interval, Interval]:
    """Return X and U of a scalar system. Raises ValueError as `state_and_input`."""
    state, input_ = state_and_input(plant)
    return state.bounds, input_.bounds


def coefficients(plant: ConstrainedSystem) -> tuple[float, float, float]:
    """Return a, b and c of x(k+1) = a x(k) + b u(k) + c. Raises ValueError for systems that are not scalar."""
    _refuse_others(plant)
    system = plant.linear
    return system.A.item(), system.B.item(), system.c.item()


def successor_set(plant: ConstrainedSystem, x: Array) -> tuple[Array, Array]:
    """Return lower and upper end of {a x + b u + c : u ∈ U}, the states reachable in one step: exact, elementwise in x.

    Raises ValueError for systems that are not scalar.
    """
    (a, b, c), (_, inputs) = coefficients(plant), interval_sets(plant)
    x = np.asarray(x, dtype=float)
    ends = [np.asarray(a * x + b * u + c) for u in (inputs.lower, inputs.upper)]
    return np.minimum(*ends), np.maximum(*ends)


def growth_rates(plant: ConstrainedSystem, states: Interval) -> tuple[float, float]:
    """Return [τ_low, τ_high] of Assumption 5: x + [τ_low, τ_high] T_s stays in the successor set of each x in `states`.

    The interval is the largest one (an inner approximation of the tube), in units per second. The tube's ends are
    affine in x, so it is enough to evaluate them at the ends of `states`. If τ_low > τ_high, there is no common rate.
    Raises ValueError for systems that are not scalar.
    """
    x = np.array([states.lower, states.upper])
    low, high = successor_set(plant, x)
    return np.max(low - x).item() / plant.sampling_time, np.min(high - x).item() / plant.sampling_time


def equilibrium_input(plant: ConstrainedSystem, x: float) -> float:
    """Return the input that holds the state at x. Raises ValueError for systems that are not scalar."""
    a, b, c = coefficients(plant)
    return (x - a * x - c) / b


def reachable_tube(reference: Reference, t: Array) -> tuple[Array, Array]:
    """Return the ends of the tube at t + T_s: the states reachable from x_r(t) in one step. Shapes as t [s].

    Raises ValueError for systems that are not scalar.
    """
    return successor_set(reference.plant, reference.state_at(t)[..., 0])


def _refuse_others(plant: ConstrainedSystem) -> None:
    if not isinstance(plant.system, LinearSystem):
        raise ValueError("only a linear system has growth rates, got a nonlinear one")
    if not is_scalar(plant):
        raise ValueError(
            "only a scalar system with bounded state and input has growth rates, "
            f"got {len(plant.system.states)} states, {len(plant.system.inputs)} inputs "
            f"and {len(plant.quantities)} bounded quantities"
        )
