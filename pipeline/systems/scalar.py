"""Scalar linear systems with bounded state and input."""

import math
from dataclasses import dataclass

import numpy as np

from pipeline.arrays import Array
from pipeline.systems.interval import Interval
from pipeline.systems.quantity import Quantity


@dataclass(frozen=True)
class ScalarLinear:
    """x(k+1) = a x(k) + b u(k) + c, with b ≠ 0 (ValueError otherwise)."""

    a: float
    b: float
    c: float = 0.0

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (self.a, self.b, self.c)) or self.b == 0:
            raise ValueError(f"system: a, b, c must be finite and b ≠ 0, got a={self.a}, b={self.b}, c={self.c}")

    def successor(self, x: Array, u: Array) -> Array:
        return np.asarray(self.a * x + self.b * u + self.c)

    def input(self, x: Array, successor: Array) -> Array:
        """The one input that takes x to the given successor: u = (x⁺ − a x − c)/b."""
        return np.asarray((successor - self.a * x - self.c) / self.b)

    def equilibrium_input(self, x: float) -> float:
        """The input that holds the state at x."""
        return (x - self.a * x - self.c) / self.b


@dataclass(frozen=True)
class ConstrainedSystem:
    """A system with its `state_set` X, its `input_set` U and its `sampling_time` T_s [s]."""

    system: ScalarLinear
    state_set: Interval
    input_set: Interval
    sampling_time: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.sampling_time) and self.sampling_time > 0):
            raise ValueError(f"system: sampling_time must be a positive finite number, got {self.sampling_time!r}")
        for name, bounds in (("state_set", self.state_set), ("input_set", self.input_set)):
            if bounds.width == 0:
                raise ValueError(f"system: {name} must have an interior, got {bounds}")

    def successor_set(self, x: Array) -> tuple[Array, Array]:
        """Lower and upper end of {f(x, u) : u ∈ U}, the reachable tube one step on: exact, elementwise in x."""
        x = np.asarray(x, dtype=float)
        ends = [self.system.successor(x, np.full_like(x, u)) for u in (self.input_set.lower, self.input_set.upper)]
        return np.minimum(*ends), np.maximum(*ends)

    def growth_rates(self, states: Interval) -> tuple[float, float]:
        """[τ_low, τ_high] of Assumption 5: x + [τ_low, τ_high] T_s stays in the successor set of each x in `states`.

        The largest such rates (an inner approximation of the tube). The tube's ends move linearly with x, so the ends
        of `states` decide. Where τ_low > τ_high there is no common rate at all.
        """
        x = np.array([states.lower, states.upper])
        low, high = self.successor_set(x)
        return np.max(low - x).item() / self.sampling_time, np.min(high - x).item() / self.sampling_time

    @property
    def state(self) -> Quantity:
        """x_r(t) = m⁺(t), wanted in X."""
        return Quantity("state", (1.0,), 0.0, self.state_set, self.sampling_time)

    @property
    def input(self) -> Quantity:
        """u_r(t) = (m⁺(t + T_s) − a m⁺(t) − c)/b, wanted in U."""
        a, b, c = self.system.a, self.system.b, self.system.c
        return Quantity("input", (-a / b, 1 / b), -c / b, self.input_set, self.sampling_time)
