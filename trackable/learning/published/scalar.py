"""What the paper does with scalar systems only: tubes and growth rates."""

from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.gp.signal import KernelSum
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.linear import LinearSystem
from trackable.systems.quantity import Quantity
from trackable.systems.reference import Reference
from trackable.systems.sets.interval import Interval
from trackable.systems.sets.polytope import Polytope


def scalar(
    a: float, b: float, c: float = 0.0, *, state_set: Interval, input_set: Interval, sampling_time: float
) -> ConstrainedSystem:
    """x(k+1) = a x(k) + b u(k) + c with x ∈ X and u ∈ U. ValueError for b = 0 or sets without interior."""
    x, u = (Polytope.box(np.array([s.lower]), np.array([s.upper])) for s in (state_set, input_set))
    return ConstrainedSystem(LinearSystem.scalar(a, b, c, sampling_time=sampling_time), x, u)


def is_scalar(plant: ConstrainedSystem) -> bool:
    """Whether the system is linear with one state and one input, each in one interval of its own."""
    sets = plant.state_set, plant.input_set
    return isinstance(plant.system, LinearSystem) and all(np.array_equal(bounds.rows, [[1.0]]) for bounds in sets)


def state_and_input(plant: ConstrainedSystem) -> tuple[Quantity, Quantity]:
    """The state and the input of a scalar system. Raises ValueError for other systems, and where one is not bounded."""
    _refuse_others(plant)
    state, entry = plant.quantities
    return state, entry


def coefficients(plant: ConstrainedSystem) -> tuple[float, float, float]:
    """a, b and c of x(k+1) = a x(k) + b u(k) + c. Raises ValueError for systems that are not scalar."""
    _refuse_others(plant)
    system = plant.linear
    return system.A.item(), system.B.item(), system.c.item()


def successor_set(plant: ConstrainedSystem, x: Array) -> tuple[Array, Array]:
    """Lower and upper end of {a x + b u + c : u ∈ U}, the reachable tube one step on: exact, elementwise in x.

    Raises ValueError for systems that are not scalar.
    """
    (a, b, c), (_, entry) = coefficients(plant), state_and_input(plant)
    x = np.asarray(x, dtype=float)
    ends = [np.asarray(a * x + b * u + c) for u in (entry.bounds.lower, entry.bounds.upper)]
    return np.minimum(*ends), np.maximum(*ends)


def growth_rates(plant: ConstrainedSystem, states: Interval) -> tuple[float, float]:
    """[τ_low, τ_high] of Assumption 5: x + [τ_low, τ_high] T_s stays in the successor set of each x in `states`.

    The largest such rates (an inner approximation of the tube) in units per second. The tube's ends move linearly with
    x, so the ends of `states` decide. Where τ_low > τ_high there is no common rate at all. Raises ValueError for
    systems that are not scalar.
    """
    x = np.array([states.lower, states.upper])
    low, high = successor_set(plant, x)
    return np.max(low - x).item() / plant.sampling_time, np.min(high - x).item() / plant.sampling_time


def equilibrium_input(plant: ConstrainedSystem, x: float) -> float:
    """The input that holds the state at x. Raises ValueError for systems that are not scalar."""
    a, b, c = coefficients(plant)
    return (x - a * x - c) / b


def reachable_tube(reference: Reference, t: Array) -> tuple[Array, Array]:
    """Ends of the tube at t + T_s: the states that the system can reach from x_r(t) in one step, in the shape of t [s].

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


@dataclass(frozen=True)
class Scalar:
    """A view of a scalar system by its numbers, for Assumption 5 and program (9) of the paper."""

    a: float
    b: float
    c: float
    state_set: Interval
    input_set: Interval
    sampling_time: float
    state: Quantity
    input: Quantity

    @staticmethod
    def describes(plant: ConstrainedSystem) -> bool:
        """Whether the system is linear with one state and one input, each in one interval of its own."""
        sets = plant.state_set, plant.input_set
        return isinstance(plant.system, LinearSystem) and all(np.array_equal(bounds.rows, [[1.0]]) for bounds in sets)

    @classmethod
    def of(cls, plant: ConstrainedSystem) -> "Scalar":
        """ValueError for nonlinear systems, and those with more than one state or input, or an unbounded one."""
        system = plant.system
        if not isinstance(system, LinearSystem):
            raise ValueError("only a linear system has growth rates, got a nonlinear one")
        if not cls.describes(plant):
            raise ValueError(
                f"only a scalar system with bounded state and input has growth rates, got {len(system.states)} states, "
                f"{len(system.inputs)} inputs and {len(plant.quantities)} bounded quantities"
            )
        state, entry = plant.quantities
        a, b, c = system.A.item(), system.B.item(), system.c.item()
        return cls(a, b, c, state.bounds, entry.bounds, plant.sampling_time, state, entry)

    def successor_set(self, x: Array) -> tuple[Array, Array]:
        """Lower and upper end of {a x + b u + c : u ∈ U}, the reachable tube one step on: exact, elementwise in x."""
        x = np.asarray(x, dtype=float)
        ends = [np.asarray(self.a * x + self.b * u + self.c) for u in (self.input_set.lower, self.input_set.upper)]
        return np.minimum(*ends), np.maximum(*ends)

    def growth_rates(self, states: Interval) -> tuple[float, float]:
        """[τ_low, τ_high] of Assumption 5: x + [τ_low, τ_high] T_s stays in the successor set of each x in `states`.

        The largest such rates (an inner approximation of the tube). The tube's ends move linearly with x, so the ends
        of `states` decide. Where τ_low > τ_high there is no common rate at all.
        """
        x = np.array([states.lower, states.upper])
        low, high = self.successor_set(x)
        return np.max(low - x).item() / self.sampling_time, np.min(high - x).item() / self.sampling_time

    def equilibrium_input(self, x: float) -> float:
        """The input that holds the state at x."""
        return (x - self.a * x - self.c) / self.b


@dataclass(frozen=True)
class ScalarReference:
    """A view of a scalar system's reference: values in the shape of the times [s] asked for, and the tube around it."""

    signal: KernelSum
    plant: Scalar

    @classmethod
    def of(cls, reference: Reference) -> "ScalarReference":
        """ValueError for other systems."""
        return cls(reference.signals[0], Scalar.of(reference.plant))

    def state(self, t: Array) -> Array:
        """x_r at t [s]."""
        return self.plant.state((self.signal,), t)

    def input(self, t: Array) -> Array:
        """u_r at t [s]."""
        return self.plant.input((self.signal,), t)

    def instants(self, steps: Array) -> Array:
        """The times k T_s [s] of steps k."""
        return np.asarray(steps) * self.plant.sampling_time

    def tube(self, t: Array) -> tuple[Array, Array]:
        """Ends of the reachable tube at t + T_s: what the system can reach from x_r(t) in one step."""
        return self.plant.successor_set(self.state(t))
