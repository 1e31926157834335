"""Flat forms of nonlinear systems: states and inputs as formulas of flat outputs at this step and at later ones."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from trackably.systems.formulas.expression import Expression, Variable, variables
from trackably.systems.formulas.hiding import Shapes
from trackably.systems.formulas.substitution import substituted
from trackably.systems.formulas.symbol import Symbol
from trackably.systems.formulas.tracing import formulas_of

MOST_SHIFTS = 12
MOST_PARTS = 30_000
"""How many operations, names and numbers a formula may have when it is written out, where shared parts count often."""
_SHIFTED = re.compile(r"z([1-9][0-9]?)\[([0-9]|1[0-2])\]")


@dataclass(frozen=True)
class FlatForm:
    """x(k) = X(z(k), z(k + 1), …) and u(k) = U(z(k), z(k + 1), …), where z_c(k + j) is the variable z{c}[{j}].

    States named in `angles` matter up to whole turns: X may jump by 2π where it takes the angle of a vector. Formulas
    in `positive` are positive wherever a reference is proved, which the proof shows; √(p²) is p for such a formula p.
    """

    states: tuple[Expression, ...]
    inputs: tuple[Expression, ...]
    angles: tuple[str, ...] = ()
    positive: tuple[Expression, ...] = ()

    def __post_init__(self) -> None:
        for formula in (*self.states, *self.inputs, *self.positive):
            for name in variables(formula):
                _ = indices(name)
        self._share_parts()
        if missing := {*range(self.outputs)} - {c for c, _ in self._shifted}:
            raise ValueError(f"flat form: no state and no input depends on z{min(missing) + 1}")

    def _share_parts(self) -> None:
        """Make one object of parts that are written alike, so that each is evaluated once."""
        shapes = Shapes()
        for name in ("states", "inputs", "positive"):
            object.__setattr__(self, name, tuple(shapes.shared(formula) for formula in getattr(self, name)))

    @classmethod
    def of(cls, function: Callable[[Any], Any], outputs: int, angles: Sequence[str] = ()) -> Self:
        """Return the flat form of a function of z that returns a list of states and one of inputs.

        z[j] is the array of the flat outputs at step k + j. The function is called with symbols: it must use
        ordinary arithmetic only (see `formulas.symbol`). ValueError: it is no such function; says why.
        """
        states, inputs = formulas_of(lambda: function(_Shifts(outputs)), "flat form")
        return cls(states, inputs, tuple(angles))

    @property
    def outputs(self) -> int:
        """The number of flat outputs."""
        return 1 + max(c for c, _ in self._shifted)

    @property
    def orders(self) -> tuple[int, ...]:
        """By how many steps each flat output looks ahead; one at least."""
        return tuple(max(1, *(j for d, j in self._shifted if d == c)) for c in range(self.outputs))

    @cached_property
    def _shifted(self) -> set[tuple[int, int]]:
        return {indices(name) for formula in (*self.states, *self.inputs) for name in variables(formula)}


def named(c: int, j: int) -> str:
    """Return the name of z_c(k + j), with c from 0 on."""
    return f"z{c + 1}[{j}]"


def indices(name: str) -> tuple[int, int]:
    """Return c and j of a shifted flat output. ValueError: the name is no such name."""
    found = _SHIFTED.fullmatch(name)
    if not found:
        raise ValueError(f"flat form: formulas must be of flat outputs, z1[0] to z99[{MOST_SHIFTS}], but hold {name}")
    return int(found[1]) - 1, int(found[2])


def one_step_later(formula: Expression) -> Expression:
    """Return the formula with every flat output one step later."""
    later = {name: Variable(named(c, j + 1)) for name in variables(formula) for c, j in [indices(name)]}
    return substituted(formula, later)


@dataclass(frozen=True)
class _Shifts:
    """z, as functions of shifted flat outputs take it."""

    outputs: int

    def __getitem__(self, j: Any) -> Any:
        if not isinstance(j, int) or not 0 <= j < MOST_SHIFTS:
            raise ValueError(f"z[j] needs a step j from 0 to {MOST_SHIFTS - 1}, got {j!r}")
        return np.array([Symbol(Variable(named(c, j))) for c in range(self.outputs)], dtype=object)

    def __iter__(self) -> Any:
        raise ValueError("z has no end: take z[0], z[1], …")
