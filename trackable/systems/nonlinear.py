"""Nonlinear systems with as many inputs as states that can be solved for the input: every state is led at will."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Self

import numpy as np

from trackable.arrays import Array
from trackable.systems.flat.flatness import Flatness
from trackable.systems.flat.functional import Functional
from trackable.systems.flat.trajectory import Trajectory
from trackable.systems.formulas.affine import Affine, Solved, solved, split
from trackable.systems.formulas.algebra import DEEPEST, Maybe, derivative
from trackable.systems.formulas.expression import Expression, Variable, at_floats, size_and_depth, variables
from trackable.systems.formulas.tracing import Dynamics, traced
from trackable.systems.linear import positive_sampling_time

LARGEST = 1000
"""How many operations, names and numbers one formula may have when it is written out."""


@dataclass(frozen=True)
class Nonlinear:
    """x(k+1) = f(x(k), u(k)) with f(x, u) = f0(x) + G(x) u, one formula `f` for each state, every `sampling_time` [s].

    `states` and `inputs` are names, all different, and as many; formulas use them as variables. Raises ValueError where
    f is not affine in the inputs, where it cannot be solved for them whatever the states are, where it is too long, and
    where the sampling time is not positive.
    """

    f: tuple[Expression, ...]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    sampling_time: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "sampling_time", positive_sampling_time(self.sampling_time))
        n = len(self.states)
        names = {*self.states, *self.inputs, *self.successors}
        if not n or len(names) != 2 * n + len(self.inputs):
            raise ValueError(
                f"system: states and inputs need names, all different, got {', '.join(self.states) or 'no states'} and "
                f"{', '.join(self.inputs) or 'no inputs'}"
            )
        if len(self.inputs) != n:
            raise ValueError(
                f"system: a nonlinear system needs as many inputs as states, so that f can be solved for them, got "
                f"{len(self.inputs)} ({', '.join(self.inputs)}) for {n} ({', '.join(self.states)})"
            )
        if len(self.f) != n:
            raise ValueError(f"system: f must have a formula for each of {n} states, got {len(self.f)}")
        for state, formula in zip(self.states, self.f, strict=True):
            size, depth = size_and_depth(formula)
            if size > LARGEST or depth > DEEPEST:
                raise ValueError(
                    f"system: the formula of {state} is too long: {size} operations, names and numbers when written "
                    f"out, and {depth} within each other; {LARGEST} and {DEEPEST} are allowed"
                )
            if unknown := variables(formula) - {*self.states, *self.inputs}:
                raise ValueError(f"system: the formula of {state} holds {', '.join(sorted(unknown))}, which is no name")
        for pivot in self.solution.pivots:
            if not variables(pivot) and not 0 < abs(float(at_floats(pivot, {}))) < np.inf:
                raise ValueError(f"system: f must be solvable for its inputs, but that would divide by {pivot}")

    @classmethod
    def of(cls, f: Dynamics, states: Sequence[str], inputs: Sequence[str], sampling_time: float) -> Self:
        """The system that a function f(x, u) of two arrays computes, which returns the successors in a list.

        It is called once, with symbols: what it does has to be ordinary arithmetic (see `formulas.tracing`), and
        numbers in it are kept as they are then. Raises ValueError also where it is not, with the reason.
        """
        return cls(traced(f, tuple(states), tuple(inputs)), tuple(states), tuple(inputs), sampling_time)

    @property
    def successors(self) -> tuple[str, ...]:
        """What the states one step later are called in the formulas of the inputs."""
        return tuple(f"{name}⁺" for name in self.states)

    @cached_property
    def equations(self) -> tuple[Affine, ...]:
        """f0 and G, row by row."""
        return tuple(split(formula, frozenset(self.inputs)) for formula in self.f)

    @cached_property
    def solution(self) -> Solved:
        """u = G(x)⁻¹ (x⁺ − f0(x)), in terms of `states` and `successors`."""
        return solved(self.equations, [Variable(name) for name in self.successors], self.inputs)

    def successor(self, x: Array, u: Array) -> Array:
        """f(x, u) for x of shape (…, n) and u of shape (…, n); NaN or infinite where it is not defined."""
        x, u = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(u, dtype=float))
        values = {**_named(self.states, x), **_named(self.inputs, u)}
        return _stacked([at_floats(formula, values) for formula in self.f], x.shape[:-1])

    def affine(self, x: Array) -> tuple[Array, Array]:
        """f0(x) and G(x) for x of shape (…, n): shapes (…, n) and (…, n, n)."""
        x = np.asarray(x, dtype=float)
        values, shape = _named(self.states, x), x.shape[:-1]
        drift = [at_floats(e.drift, values) if e.drift else np.zeros(shape) for e in self.equations]
        gains = [
            _stacked([at_floats(e.gains[j], values) if j in e.gains else np.zeros(shape) for j in self.inputs], shape)
            for e in self.equations
        ]
        return _stacked(drift, shape), np.stack(gains, axis=-2)

    def slopes(self, x: Array, u: Array) -> tuple[Array, Array]:
        """∂f/∂x and ∂f/∂u at x and u of shape (…, n): shapes (…, n, n)."""
        x, u = np.broadcast_arrays(np.asarray(x, dtype=float), np.asarray(u, dtype=float))
        values, shape = {**_named(self.states, x), **_named(self.inputs, u)}, x.shape[:-1]

        def at(names: tuple[str, ...]) -> Array:
            rows = [[self.derivatives[i, name] for name in names] for i in range(len(self.f))]
            evaluated = [[at_floats(e, values) if e is not None else np.zeros(shape) for e in row] for row in rows]
            return np.stack([_stacked(row, shape) for row in evaluated], axis=-2)

        return at(self.states), at(self.inputs)

    @cached_property
    def derivatives(self) -> Mapping[tuple[int, str], Maybe]:
        """∂f_i/∂(state or input) by i and name, as formulas."""
        names = (*self.states, *self.inputs)
        return {(i, name): derivative(formula, name) for i, formula in enumerate(self.f) for name in names}

    def flatness(self) -> Flatness:
        """The states themselves are learned; inputs follow from them and their successors."""
        n = len(self.states)
        looks: dict[str, Functional] = {}
        for i, (now, later) in enumerate(zip(self.states, self.successors, strict=True)):
            looks[now] = _look(i, n, (Fraction(1),), self.sampling_time)
            looks[later] = _look(i, n, (Fraction(0), Fraction(1)), self.sampling_time)
        formulas = [self.solution.inputs[name] for name in self.inputs]
        return Flatness(
            tuple(looks[name] for name in self.states),
            tuple(Trajectory.made(formula, looks) for formula in formulas),
            (1,) * n,
        )


def _look(signal: int, count: int, weights: tuple[Fraction, ...], sampling_time: float) -> Functional:
    nothing = tuple(Fraction(0) for _ in weights)
    return Functional(tuple(weights if c == signal else nothing for c in range(count)), Fraction(0), sampling_time)


def _named(names: tuple[str, ...], values: Array) -> Mapping[str, Array]:
    return {name: values[..., i] for i, name in enumerate(names)}


def _stacked(columns: list[Array], shape: tuple[int, ...]) -> Array:
    return np.stack([np.broadcast_to(column, shape) for column in columns], axis=-1)
