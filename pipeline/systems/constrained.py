"""A system with its sets: what has to be bounded for a reference to be trackable."""

import math
from collections import Counter
from dataclasses import dataclass
from functools import cached_property

from pipeline.arrays import Array
from pipeline.systems.flatness import Flatness, flatness
from pipeline.systems.linear import Linear
from pipeline.systems.nonlinear import Nonlinear
from pipeline.systems.polytope import Polytope
from pipeline.systems.quantity import Quantity
from pipeline.systems.trajectory import Coordinate, combined

System = Linear | Nonlinear


@dataclass(frozen=True, eq=False)
class ConstrainedSystem:
    """A system with its `state_set` X, its `input_set` U and its `sampling_time` T_s [s].

    Raises ValueError where the sets do not fit the system, where a linear one is not controllable, and where an input
    of a nonlinear one is not bounded.
    """

    system: System
    state_set: Polytope
    input_set: Polytope
    sampling_time: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.sampling_time) and self.sampling_time > 0):
            raise ValueError(f"system: sampling_time must be a positive finite number, got {self.sampling_time!r}")
        n, m = len(self.system.states), len(self.system.inputs)
        for name, bounds, dimension in (("state_set", self.state_set, n), ("input_set", self.input_set, m)):
            if bounds.dimension != dimension:
                raise ValueError(f"system: {name} must have dimension {dimension}, got {bounds.dimension}")
        if isinstance(self.system, Nonlinear) and (free := _free(self.system.inputs, self.input_set)):
            raise ValueError(
                f"system: every input of a nonlinear system must be bounded, as nothing else shows that there is one "
                f"that f can be solved for, but {', '.join(free)} is free; a bound that is never reached will do"
            )
        _ = self.flatness  # raise what it refuses

    @cached_property
    def flatness(self) -> Flatness:
        """States and inputs in terms of the signals that are learned."""
        if isinstance(self.system, Nonlinear):
            return self.system.flatness(self.sampling_time)
        return flatness(self.system, self.sampling_time)

    @property
    def linear(self) -> Linear:
        """The system, for what is done with linear ones only. ValueError for others."""
        if not isinstance(self.system, Linear):
            raise ValueError(f"system: must be linear here, got one with {', '.join(map(str, self.system.f))}")
        return self.system

    @property
    def signals(self) -> int:
        """How many signals are learned."""
        return len(self.flatness.orders)

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """All that is bounded: trackable means that each stays in its bounds at t = k T_s for all k ≥ 0."""
        return (
            *_bounded(self.state_set, self.flatness.states, self.system.states),
            *_bounded(self.input_set, self.flatness.inputs, self.system.inputs),
        )


def _bounded(wanted: Polytope, coordinates: tuple[Coordinate, ...], names: tuple[str, ...]) -> list[Quantity]:
    """A quantity for each row, called as the row is written; rows of one name are numbered."""
    written = Counter[str]()
    quantities = []
    for row, bounds in wanted.intervals:
        name = _name(row, names)
        written[name] += 1
        numbered = name if written[name] == 1 else f"{name} ({written[name]})"
        quantities.append(Quantity(numbered, combined(row.tolist(), coordinates), bounds))
    return quantities


def _name(row: Array, names: tuple[str, ...]) -> str:
    """x, or x+y, or x-0.5y."""
    signed = []
    for weight, name in zip(row.tolist(), names, strict=True):
        if weight:
            size = "" if abs(weight) == 1 else f"{abs(weight):.3g}"
            signed.append(f"{'-' if weight < 0 else '+'}{size}{name}")
    return "".join(signed).removeprefix("+")


def _free(names: tuple[str, ...], wanted: Polytope) -> list[str]:
    """The coordinates that no row looks at."""
    return [name for name, column in zip(names, wanted.rows.T, strict=True) if not column.any()]
