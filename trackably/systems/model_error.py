"""A wrong model: plants whose matrices lie in a convex hull, treated as a larger disturbance of the nominal one.

The plant is x⁺ = A x + B u + c + w with (A, B, c) anywhere in the convex hull of given vertices, possibly another point
at each step. The reference obeys the nominal matrices for which it is learned. As long as states and inputs keep their
sets, which the proof ensures, the effect of the difference lies in a zonotope D, and W ⊕ D takes the place of W.
`trackably.checker.model_error` has the theorem and its proof.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Self

import numpy as np

from trackably.arguments import instance, numbers
from trackably.arrays import Array, ArrayLike
from trackably.checker import model_error as checked
from trackably.checker.subject import Polytope as Rows
from trackably.checker.subject import Row
from trackably.systems.disturbances import DisturbanceSet, Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

_MOST_ENTRIES = 6  # uncertain entries; all combinations of their ends are vertices


@dataclass(frozen=True, eq=False)
class Vertex:
    """x⁺ = A x + B u + c with A (n, n), B (n, m) and c (n,)."""

    A: Array
    B: Array
    c: Array

    def __post_init__(self) -> None:
        for array in (self.A, self.B, self.c):
            array.flags.writeable = False


@dataclass(frozen=True, eq=False)
class ModelError:
    """The plant's (A, B, c) is anywhere in the convex hull of these `vertices`, possibly another point at each step.

    The vertices are matrices of discrete time: `of` takes them directly, `intervals` takes intervals of single entries,
    and `sampled` takes matrices of continuous time.
    """

    vertices: tuple[Vertex, ...]

    @classmethod
    def of(cls, vertices: Sequence[tuple[ArrayLike, ArrayLike] | tuple[ArrayLike, ArrayLike, ArrayLike]]) -> Self:
        """Return the hull of (A, B) or (A, B, c), of shapes (n, n), (n, m), (n,). ValueError: shapes do not fit."""
        found = []
        for i, given in enumerate(vertices):
            system = LinearSystem(*given, sampling_time=1.0)  # its checks are those of a vertex
            found.append(Vertex(system.A, system.B, system.c))
            if system.B.shape != found[0].B.shape:
                raise ValueError(f"model_error: vertex {i + 1} must have the shapes of the first one")
        if not found:
            raise ValueError("model_error: expected a vertex at least")
        return cls(tuple(found))

    @classmethod
    def intervals(cls, system: LinearSystem, entries: Mapping[tuple[str, str], tuple[float, float]]) -> Self:
        """Return all systems with some entries in intervals, for example {("velocity", "force"): (0.018, 0.022)}.

        The first name is the state of the row; the second one the state or the input of the column, or "1" for c. The
        other entries are those of `system`. ValueError: an unknown name, or more than 6 entries.
        """
        columns = (*system.states, *system.inputs, "1")
        if not 0 < len(entries) <= _MOST_ENTRIES:
            raise ValueError(f"model_error: intervals: expected up to {_MOST_ENTRIES} entries, got {len(entries)}")
        for row, column in entries:
            if row not in system.states or column not in columns:
                raise ValueError(f"model_error: intervals: expected a state and one of {columns}, got {row}, {column}")
        found = []
        for ends in product(*entries.values()):
            whole = np.column_stack([system.A, system.B, system.c])
            for (row, column), value in zip(entries, ends, strict=True):
                whole[system.states.index(row), columns.index(column)] = value
            n = len(system.states)
            found.append((whole[:, :n], whole[:, n:-1], whole[:, -1]))
        return cls.of(found)

    @classmethod
    def sampled(cls, vertices: Sequence[tuple[ArrayLike, ArrayLike]], sampling_time: float) -> Self:
        """Return the hull of ẋ = A x + B u, sampled with the input held, where all (A, B) have the same A.

        Then the discrete matrices are linear in B, so that the hull of the sampled vertices contains all sampled
        systems. This covers an uncertain gain, or the mass of a double integrator, which enters as 1/m. ValueError: A
        differs. Sampling is nonlinear in A, so that sampled vertices do not enclose the systems between them; then
        enclose the discrete matrices by `of` or `intervals`.
        """
        given = [(numbers("model_error: A", A), numbers("model_error: B", B)) for A, B in vertices]
        if any(not np.array_equal(A, given[0][0]) for A, _ in given):
            raise ValueError(
                "model_error: sampled: A of continuous time is not known exactly, and exp(A T) is curved: the hull of "
                "sampled end points does not hold what lies between them; enclose the discrete matrices instead"
            )
        systems = [LinearSystem.discretised(A, B, sampling_time) for A, B in given]
        return cls.of([(system.A, system.B, system.c) for system in systems])

    def generators(self, system: LinearSystem, state_set: Polytope, input_set: Polytope) -> list[Sequence[Fraction]]:
        """Return the generators of D, exactly.

        ValueError: shapes do not fit, or an unbounded state has an uncertain coefficient.
        """
        nominal = checked.Vertex(system.A.tolist(), system.B.tolist(), system.c.tolist())
        vertices = [checked.Vertex(v.A.tolist(), v.B.tolist(), v.c.tolist()) for v in self.vertices]
        found = checked.of_model_error(nominal, vertices, _rows(state_set), _rows(input_set))
        if isinstance(found, str):
            raise ValueError(f"model_error: {found}")
        return list(found)

    def beside(self, disturbance: DisturbanceSet | None) -> Zonotope:
        """Return W, or {0} if there is no disturbance. TypeError: it is no zonotope."""
        W = Zonotope([Fraction(0)] * len(self.vertices[0].A)) if disturbance is None else disturbance
        instance("disturbance, with model_error", W, Zonotope, "a Zonotope, as of Zonotope.box(lower, upper)")
        assert isinstance(W, Zonotope), "instance has refused anything else"
        return W

    def added_to(self, W: Zonotope, system: LinearSystem, state_set: Polytope, input_set: Polytope) -> Zonotope:
        """Return W ⊕ D, exactly. Raises as `generators`."""
        return Zonotope(W.centre, [*W.generators, *self.generators(system, state_set, input_set)])

    def __str__(self) -> str:
        return f"the convex hull of {len(self.vertices)} systems"


def _rows(bounded: Polytope) -> Rows:
    rows = zip(bounded.rows.tolist(), bounded.lower.tolist(), bounded.upper.tolist(), strict=True)
    return Rows(tuple(Row(tuple(map(Fraction, row)), low, high) for row, low, high in rows), bounded.dimension)
