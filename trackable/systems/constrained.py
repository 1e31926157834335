"""A system with its sets: what has to be bounded for a reference to be trackable."""

from collections import Counter
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import chain
from typing import Literal, NamedTuple

from trackable.systems.flat.flatness import Flatness, flatness
from trackable.systems.flat.trajectory import combined
from trackable.systems.linear import LinearSystem
from trackable.systems.nonlinear import Nonlinear
from trackable.systems.quantity import Quantity
from trackable.systems.sets.allocation import Allocation
from trackable.systems.sets.interval import Interval
from trackable.systems.sets.polytope import Polytope
from trackable.systems.wording import shortened, written

System = LinearSystem | Nonlinear


Side = Literal["state", "input"]


class Limit(NamedTuple):
    """`bounds` of Σ_i `row`[i] x_i, or of Σ_i `row`[i] u_i: `of` says which."""

    name: str
    of: Side
    row: tuple[Fraction, ...]
    bounds: Interval


@dataclass(frozen=True, eq=False)
class ConstrainedSystem:
    """A system with its `state_set` X and its `input_set` U.

    Raises ValueError where the sets do not fit the system, where a linear one is not controllable or has too many
    redundant inputs, and where an input of a nonlinear one is not bounded.
    """

    system: System
    state_set: Polytope
    input_set: Polytope

    def __post_init__(self) -> None:
        n, m = len(self.system.states), len(self.system.inputs)
        for name, bounds, dimension in (("state_set", self.state_set, n), ("input_set", self.input_set, m)):
            if bounds.dimension != dimension:
                raise ValueError(f"system: {name} must have dimension {dimension}, got {bounds.dimension}")
        if isinstance(self.system, Nonlinear) and (free := _free(self.system.inputs, self.input_set)):
            raise ValueError(
                f"system: every input of a nonlinear system must be bounded, as nothing else shows that there is one "
                f"that f can be solved for, but {', '.join(free)} is free; a bound that is never reached will do"
            )
        _ = self.flatness, self.needed  # raise what they refuse

    @property
    def sampling_time(self) -> float:
        """T_s [s], as the system has it."""
        return self.system.sampling_time

    @cached_property
    def flatness(self) -> Flatness:
        """States and inputs in terms of the signals that are learned."""
        if isinstance(self.system, Nonlinear):
            return self.system.flatness()
        return flatness(self.system)

    @property
    def linear(self) -> LinearSystem:
        """The system, for what is done with linear ones only. ValueError for others."""
        if not isinstance(self.system, LinearSystem):
            raise ValueError(f"system: must be linear here, got one with {', '.join(map(str, self.system.f))}")
        return self.system

    @property
    def signals(self) -> int:
        """How many signals are learned."""
        return len(self.flatness.orders)

    @cached_property
    def allocation(self) -> Allocation | None:
        """How inputs are chosen where many push the system alike; None where none do."""
        return Allocation.of(self.system, self.input_set) if isinstance(self.system, LinearSystem) else None

    @cached_property
    def limits(self) -> tuple[Limit, ...]:
        """The rows of X and of U, as they are given."""
        return self._called(self._given("state", self.state_set), self._given("input", self.input_set))

    @cached_property
    def needed(self) -> tuple[Limit, ...]:
        """What the trajectories of `flatness` have to keep so that inputs in U exist which lead from state to state.

        These are the limits themselves, but for redundant inputs.
        """
        if self.allocation is None:
            return self.limits
        return self._called(
            self._given("state", self.state_set),
            [Limit("", "input", row, bounds) for row, bounds in self.allocation.attainable],
        )

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """All that is bounded: trackable means that each stays in its bounds at t = k T_s for all k ≥ 0."""
        coordinates = {"state": self.flatness.states, "input": self.flatness.inputs}
        return tuple(Quantity(name, combined(row, coordinates[of]), bounds) for name, of, row, bounds in self.needed)

    @staticmethod
    def _given(of: Side, wanted: Polytope) -> list[Limit]:
        return [Limit("", of, tuple(map(Fraction, row.tolist())), bounds) for row, bounds in wanted.intervals]

    def _called(self, *sides: list[Limit]) -> tuple[Limit, ...]:
        """Each called as its row is written; those that would have one name are numbered."""
        names = {"state": self.system.states, "input": self.system.inputs}
        counted = Counter[str]()
        called = []
        for limit in chain(*sides):
            name = shortened(written(limit.row, names[limit.of]))
            counted[name] += 1
            called.append(limit._replace(name=name if counted[name] == 1 else f"{name} ({counted[name]})"))
        return tuple(called)


def _free(names: tuple[str, ...], wanted: Polytope) -> list[str]:
    """The coordinates that no row looks at."""
    return [name for name, column in zip(names, wanted.rows.T, strict=True) if not column.any()]
