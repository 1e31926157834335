"""A system with its state set and input set, and the constraints that make a reference trackable."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from trackably.arguments import instance
from trackably.arrays import Array
from trackably.checker.formulas import text
from trackably.checker.subject import Side, numbered, sum_name
from trackably.gp.samples import Samples
from trackably.systems.allocation import Allocation
from trackably.systems.flat_forms import FlatForm
from trackably.systems.linear import Flatness, LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import BoundedRow, Polytope
from trackably.systems.trajectories import Quantity, Trajectory, weighted_sum

System = LinearSystem | NonlinearSystem


@dataclass(frozen=True, eq=False)
class ConstrainedSystem:
    """A system with its `state_set` X and its `input_set` U.

    ValueError: the sets do not fit the system, a linear system is not controllable or has too many redundant inputs, or
    a nonlinear system without a flat form has an unbounded input. TypeError: the system or a set is of another type.
    """

    system: System
    state_set: Polytope
    input_set: Polytope

    def __post_init__(self) -> None:
        instance("plant: system", self.system, LinearSystem | NonlinearSystem, "a LinearSystem or a NonlinearSystem")
        for name in ("state_set", "input_set"):
            instance(f"plant: {name}", getattr(self, name), Polytope, "a Polytope, such as Polytope.box(lower, upper)")
        n, m = len(self.system.states), len(self.system.inputs)
        sides = (("state_set", self.state_set, n), ("input_set", self.input_set, m))
        if wrong := [f"{name} must have dimension {k}, got {X.dimension}" for name, X, k in sides if X.dimension != k]:
            raise ValueError(f"system: {', and '.join(wrong)}")
        if isinstance(self.system, NonlinearSystem):
            free = [self.system.inputs[i] for i in np.flatnonzero(~self.input_set.rows.any(axis=0))]
            if free and not self.system.flat:
                raise ValueError(
                    f"system: every input of a nonlinear system must be bounded, because the proof of its bounds also "
                    f"proves that the input exists, but {', '.join(free)} has no bounds; give bounds, however wide"
                )
            object.__setattr__(self, "system", self.system.heading_in(self.state_set))
        _ = self.flatness, self.quantities  # computed here, to raise errors as soon as the object is created

    @property
    def sampling_time(self) -> float:
        """T_s [s] of the system."""
        return self.system.sampling_time

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the states, then those of the inputs."""
        return (*self.system.states, *self.system.inputs)

    @property
    def moves(self) -> bool:
        """Whether a bound moves in time."""
        return self.state_set.moves or self.input_set.moves

    @cached_property
    def flatness(self) -> Flatness:
        """States and inputs as functions of the flat outputs, which are the learned signals."""
        return self.system.flatness()

    @property
    def coordinates(self) -> dict[Side, tuple[Trajectory, ...]]:
        """States and inputs as functions of the flat outputs, under the keys "state" and "input"."""
        return {"state": self.flatness.states, "input": self.flatness.inputs}

    @property
    def flat_form(self) -> FlatForm | None:
        """The flat form of a nonlinear system that has one."""
        return self.system.flat if isinstance(self.system, NonlinearSystem) else None

    @cached_property
    def angles(self) -> list[int]:
        """The indices of the states that are angles, which are equal up to whole turns."""
        form = self.flat_form
        return [i for i, name in enumerate(self.system.states) if form is not None and name in form.angles]

    def unwrap(self, states: Array, near: Array | None = None) -> Array:
        """Return successive states (K, n) with whole turns added to the angles, so that they do not jump.

        The angles begin as near as possible to those of the state `near` (n,), if it is given. Without this, a
        controller that follows a heading would make a full turn when the heading jumps from π to −π.
        """
        turned = np.array(states)
        if not self.angles:
            return turned
        before = turned[:0] if near is None else near[None]
        turned[:, self.angles] = np.unwrap(np.vstack([before, states])[:, self.angles], axis=0)[len(before) :]
        return turned

    @property
    def linear(self) -> LinearSystem:
        """The system, if it is linear. ValueError: it is nonlinear."""
        if not isinstance(self.system, LinearSystem):
            raise ValueError(
                f"system: expected a linear system, got a nonlinear one with f = {', '.join(map(text, self.system.f))}"
            )
        return self.system

    def flat_samples(self, samples: Mapping[str, Samples]) -> dict[str, Samples]:
        """Return samples of the flat outputs z1, z2, … of a linear system, computed from samples of its states by name.

        z_c = Σ_i q_ci x_i, where the states are sampled at the same times. Their noises σ_n · `relative_noise` count as
        independent, so that the noise of z_c is the same σ_n times its own relative noise. ValueError: the system is
        nonlinear, or a state that z_c depends on is not sampled, or at other times.
        """
        states, found = self.linear.states, dict[str, Samples]()
        for c, row in enumerate(self.flatness.outputs):
            weights = {state: float(q) for state, q in zip(states, row, strict=True) if q}
            given, missing = [samples[state] for state in weights if state in samples], [*weights.keys() - samples]
            if missing or any(not np.array_equal(of.times, given[0].times) for of in given):
                raise ValueError(
                    f"samples: z{c + 1} is computed from samples of {', '.join(weights)} at the same times, but "
                    + (f"there are none of {', '.join(sorted(missing))}" if missing else "their times differ")
                )
            q = np.array(list(weights.values()))
            noise = np.sqrt(q**2 @ [of.relative_noise**2 for of in given])
            found[f"z{c + 1}"] = Samples(given[0].times, q @ [of.values for of in given], noise)
        return found

    @property
    def signal_count(self) -> int:
        """The number of signals that are learned: one for each flat output."""
        return len(self.flatness.orders)

    @cached_property
    def allocation(self) -> Allocation | None:
        """The choice among redundant inputs; None if no inputs are redundant."""
        return Allocation.of(self.system, self.input_set) if isinstance(self.system, LinearSystem) else None

    @cached_property
    def given_constraints(self) -> tuple[Quantity, ...]:
        """The given bounds of all rows of the state set X, then of all rows of the input set U."""
        return self._quantities(self.input_set.bounded_rows)

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """All bounded quantities: a reference is trackable if each is inside its bounds at t = k T_s for all k ≥ 0.

        An input in U then leads from each state to the next one. Without redundant inputs, these are the given
        constraints. With redundant inputs, combinations of the rows of U replace the rows of U; an input satisfies the
        combinations if and only if some input in U has the same effect.
        """
        return self._quantities(self.allocation.attainable) if self.allocation else self.given_constraints

    def _quantities(self, of_inputs: list[BoundedRow]) -> tuple[Quantity, ...]:
        """Return the rows of states, then those of inputs, each named after its row; equal names are numbered."""
        sides: tuple[tuple[Side, tuple[str, ...], list[BoundedRow]], ...] = (
            ("state", self.system.states, self.state_set.bounded_rows),
            ("input", self.system.inputs, of_inputs),
        )
        called = numbered(sum_name(row, names) for _, names, rows in sides for row, _ in rows)
        every = ((side, *of) for side, _, rows in sides for of in rows)
        return tuple(
            Quantity(q.formula, q.arguments, name, side, row, bounds)
            for name, (side, row, bounds) in zip(called, every, strict=True)
            for q in [weighted_sum(row, self.coordinates[side])]
        )
