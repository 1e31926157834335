"""Sets of disturbances (zonotopes and convex hulls), measurement noise and model errors, in exact rational numbers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import product
from reprlib import repr as short
from typing import Any, Self, cast

import numpy as np
import scipy

from trackably.arguments import array, instance, numbers
from trackably.arrays import Array, ArrayLike
from trackably.checker import disturbances as checker
from trackably.checker import model_error as checked
from trackably.checker import subject
from trackably.checker.answers import FailedStepError
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import ends_within
from trackably.systems.linear import LinearSystem
from trackably.systems.rationals import ExactLike, exact

Vector = tuple[Fraction, ...]


def _exactly(what: str, given: ExactLike, *shape: int | None) -> Any:
    """Return an array of this shape as rationals, in nested lists. Fractions are kept, and float64 numbers are exact.

    ValueError: the shape differs, or a number is not finite. TypeError: an entry is no number.
    """
    array(what, cast(ArrayLike, given), *shape)
    return exact(given).tolist()


class _ExactSet(ABC):
    """A set W of disturbances w ∈ Rⁿ, defined by rational vectors. Subclasses also inherit the checker's classes."""

    @property
    @abstractmethod
    def vectors(self) -> tuple[Vector, ...]:
        """The vectors that define the set: a centre and generators, or vertices."""

    @property
    def dimension(self) -> int:
        return len(self.vectors[0])

    @cached_property
    def matrix(self) -> Array:
        """The vectors that define the set in float64, one in each row."""
        return np.array(self.vectors, dtype=float)


# Disturbance sets that are zonotopes, such as boxes.


@dataclass(frozen=True)
class Zonotope(checker.Zonotope, _ExactSet):
    """{`centre` + Σ_j ξ_j `generators`[j] : |ξ_j| ≤ 1}, exactly; float64 numbers are converted exactly.

    Without generators, the set is the centre alone. ValueError: shapes do not fit, or a number is not finite.
    """

    centre: Vector
    generators: tuple[Vector, ...]

    def __init__(self, centre: ExactLike, generators: ExactLike = ()) -> None:
        middle = tuple(_exactly("disturbance: centre", centre, None))
        given = len(cast(Sequence[Any], generators))
        rows = _exactly("disturbance: generators", generators, None, len(middle)) if given else []
        vars(self).update(centre=middle, generators=tuple(map(tuple, rows)))

    @classmethod
    def box(cls, lower: ArrayLike, upper: ArrayLike) -> Self:
        """Return {w : lower ≤ w ≤ upper} with finite bounds of shape (n,); a state with equal bounds is undisturbed.

        ValueError: a lower bound exceeds the upper one, or shapes do not fit.
        """
        low = array("disturbance: lower", lower, None)
        high = array("disturbance: upper", upper, len(low))
        for i in np.flatnonzero(low > high).tolist():
            raise ValueError(
                f"disturbance: needs bounds lower ≤ upper, got [{low[i]:g}, {high[i]:g}] for state {i + 1}"
            )
        halves = (exact(high) - exact(low)) / 2
        return cls((exact(low) + halves).tolist(), np.diag(halves)[halves != 0].tolist())

    def support(self, rows: Array) -> Array:
        """Return h_W(row) = max {row · w : w ∈ W} in float64 for rows (…, n); the result has shape (…)."""
        spread = np.abs(np.asarray(rows) @ self.generator_matrix.T).sum(axis=-1)
        return np.asarray(np.asarray(rows) @ self.matrix[0] + spread)

    @property
    def generator_matrix(self) -> Array:
        """The generators in float64, shape (g, n)."""
        return self.matrix[1:]

    def farthest(self, row: Array) -> Array:
        """Return a point (n,) of the set, up to rounding, at which row · w is largest."""
        return self._point(np.where(self.generator_matrix @ row >= 0, 1.0, -1.0))

    def draw(self, rng: np.random.Generator) -> Array:
        """Return a random point (n,) of the set, up to rounding."""
        return self._point(rng.uniform(-1, 1, len(self.generators)))

    def _point(self, parts: Array) -> Array:
        return np.asarray(self.matrix[0] + parts @ self.generator_matrix)

    def __repr__(self) -> str:
        return f"Zonotope(centre={self.matrix[0].tolist()}, generators={self.generator_matrix.tolist()})"

    def __str__(self) -> str:
        middle, G = exact(self.centre), exact(self.generators).reshape(-1, self.dimension)
        if np.all(np.sum(G != 0, axis=0) <= 1) and np.all(np.sum(G != 0, axis=1) == 1):
            half = np.sum(np.abs(G), axis=0)
            ends = zip(middle - half, middle + half, strict=True)
            return " × ".join(f"[{', '.join(ends_within(*map(float, of)))}]" for of in ends)
        return f"a zonotope with {len(self.generators)} generators"


# Disturbance sets that are convex hulls of vertices.


@dataclass(frozen=True)
class ConvexHull(checker.Hull, _ExactSet):
    """The convex hull of `vertices`, exactly; float64 numbers are converted exactly.

    Some of these points may lie inside the hull. Of a set {w : H w ≤ h} with the interior point p, the vertices are
    `scipy.spatial.HalfspaceIntersection(np.column_stack([H, -h]), p).intersections`, up to rounding. ValueError: shapes
    do not fit, there is no vertex, or a number is not finite.
    """

    vertices: tuple[Vector, ...]

    def __init__(self, vertices: ExactLike) -> None:
        vars(self).update(vertices=tuple(map(tuple, _exactly("disturbance: vertices", vertices, None, None))))

    def support(self, rows: Array) -> Array:
        """Return h_W(row) = max {row · w : w ∈ W} in float64 for rows (…, n); the result has shape (…)."""
        return np.asarray(np.max(np.asarray(rows) @ self.matrix.T, axis=-1))

    def farthest(self, row: Array) -> Array:
        """Return a vertex (n,), up to rounding, at which row · w is largest."""
        return np.asarray(self.matrix[int(np.argmax(self.matrix @ row))])

    def draw(self, rng: np.random.Generator) -> Array:
        """Return a random point (n,) of the set, up to rounding."""
        return rng.dirichlet(np.ones(len(self.vertices))) @ self.matrix

    def __repr__(self) -> str:
        return f"ConvexHull({self.matrix.tolist()})"

    def __str__(self) -> str:
        return f"a polytope with {len(self.vertices)} vertices"


# The kinds of disturbance sets, and conditions that all of them have to satisfy.

DisturbanceSet = Zonotope | ConvexHull


def require_disturbance(given: object, states: int, what: str = "disturbance") -> DisturbanceSet:
    """Return `given` if it is a disturbance set of a system with this number of `states`; errors begin with `what`.

    TypeError: `given` is no disturbance set. ValueError: it has another dimension, or it does not contain 0. It has to
    contain 0, so that the undisturbed system is a special case of the disturbed one.
    """
    instance(what, given, DisturbanceSet, "a Zonotope, such as Zonotope.box(lower, upper), or a ConvexHull")
    assert isinstance(given, DisturbanceSet), "instance has refused anything else"
    if given.dimension != states:
        raise ValueError(
            f"{what}: expected vectors with an entry for each of {states} states, got vectors with {given.dimension} "
            "entries"
        )
    if not _holds_zero(given):
        raise ValueError(
            f"{what}: must contain 0, got {given}; add its centre to c of the system, and subtract it from the set"
        )
    return given


def require_zonotope(what: str, given: object) -> Zonotope:
    """Return `given` if it is a zonotope. TypeError, whose message begins with `what`: it is anything else."""
    instance(what, given, Zonotope, "a Zonotope, such as Zonotope.box(lower, upper)")
    assert isinstance(given, Zonotope), "instance has refused anything else"
    return given


def _holds_zero(given: DisturbanceSet) -> bool:
    """Whether 0 is in a set, up to the tolerance of a linear program whose equations are scaled to size one."""
    if isinstance(given, Zonotope):
        matrix, aim, bounds = given.generator_matrix.T, -given.matrix[0], (-1.0, 1.0)
        if not matrix.size:
            return not aim.any()
    else:
        matrix, bounds = np.vstack([given.matrix.T, np.ones(len(given.vertices))]), (0.0, 1.0)
        aim = np.append(np.zeros(given.dimension), 1.0)
    size = np.max(np.abs(np.column_stack([matrix, aim])), axis=1)
    unit = np.where(size > 0, size, 1.0)
    none = np.zeros(matrix.shape[1])
    program = scipy.optimize.linprog(none, A_eq=matrix / unit[:, None], b_eq=aim / unit, bounds=bounds, method="highs")
    return program.x is not None


# A wrong model: plants whose matrices lie in a convex hull, treated as a larger disturbance of the nominal plant.
#
# The plant is x⁺ = A x + B u + c + w with (A, B, c) anywhere in the convex hull of given vertices, possibly at another
# point in each step. The reference obeys the nominal matrices with which it is learned. As long as states and inputs
# stay in their sets, which is proved, the effect of the difference in (A, B, c) lies in a zonotope D, and the set of
# disturbances is W ⊕ D instead of W. `trackably.checker.model_error` has the theorem and its proof.


_MOST_ENTRIES = 6  # largest number of uncertain entries: k entries give 2^k vertices


@dataclass(frozen=True, eq=False)
class Vertex:
    """A vertex of a hull of systems: x⁺ = A x + B u + c with A (n, n), B (n, m) and c (n,)."""

    A: Array
    B: Array
    c: Array


@dataclass(frozen=True, eq=False)
class ModelError:
    """The plant's (A, B, c) is anywhere in the convex hull of these `vertices`, possibly another point at each step.

    The vertices are matrices of discrete time: `of` takes them directly, `intervals` takes intervals of single entries,
    and `sampled` takes matrices of continuous time.
    """

    vertices: tuple[Vertex, ...]

    @classmethod
    def of(cls, vertices: Sequence[tuple[ArrayLike, ArrayLike] | tuple[ArrayLike, ArrayLike, ArrayLike]]) -> Self:
        """Return the hull of (A, B) or (A, B, c), of shapes (n, n), (n, m), (n,).

        TypeError: these are no vertices. ValueError: shapes do not fit.
        """
        # A LinearSystem checks A, B and c of a vertex; its sampling time has no effect here.
        systems = [LinearSystem(A, B, *c, sampling_time=1.0) for A, B, *c in _matrices(vertices)]
        for i, system in enumerate(systems):
            if system.B.shape != systems[0].B.shape:
                raise ValueError(
                    f"model_error: expected matrices of the same shapes in all vertices, got B of shape "
                    f"{system.B.shape} in vertex {i + 1} and of shape {systems[0].B.shape} in vertex 1"
                )
        return cls(tuple(Vertex(system.A, system.B, system.c) for system in systems))

    @classmethod
    def intervals(cls, system: LinearSystem, entries: Mapping[tuple[str, str], tuple[float, float]]) -> Self:
        """Return the hull of all systems with entries in intervals, such as {("velocity", "force"): (0.018, 0.022)}.

        Each key of `entries` is a pair of names: first the state of the row, then the state or the input of the column,
        or "1" for c. Entries without an interval have the value in `system`. TypeError: an argument is of another type.
        ValueError: an unknown name, no interval, or more than 6 entries.
        """
        instance("model_error: intervals: system", system, LinearSystem, "a LinearSystem")
        instance("model_error: intervals", entries, Mapping, "intervals by the names of row and column")
        columns = (*system.states, *system.inputs, "1")
        if not 0 < len(entries) <= _MOST_ENTRIES:
            raise ValueError(f"model_error: intervals: expected 1 to {_MOST_ENTRIES} entries, got {len(entries)}")
        intervals = []
        for entry, given in entries.items():
            if entry not in product(system.states, columns):
                raise ValueError(
                    f"model_error: intervals: expected a pair of names, one of {', '.join(system.states)}, and one of "
                    f"{', '.join(columns)}, got {entry!r}"
                )
            lower, upper = array(f"model_error: intervals: {', '.join(entry)}", given, 2).tolist()
            if lower > upper:
                raise ValueError(f"model_error: intervals: {', '.join(entry)}: needs lower ≤ upper, got {given!r}")
            intervals.append((lower, upper))
        found = []
        for ends in product(*intervals):
            whole = np.column_stack([system.A, system.B, system.c])
            for (row, column), value in zip(entries, ends, strict=True):
                whole[system.states.index(row), columns.index(column)] = value
            n = len(system.states)
            found.append((whole[:, :n], whole[:, n:-1], whole[:, -1]))
        return cls.of(found)

    @classmethod
    def sampled(
        cls,
        vertices: Sequence[tuple[ArrayLike, ArrayLike] | tuple[ArrayLike, ArrayLike, ArrayLike]],
        sampling_time: float,
    ) -> Self:
        """Return the hull of systems ẋ = A x + B u + c, sampled with the input held over each `sampling_time` [s].

        The `vertices` are (A, B) or (A, B, c) of continuous time, all with the same A. Then the discrete matrices are
        linear in B and c, so that the hull of the sampled vertices contains all sampled systems. This covers an
        uncertain gain, or the mass of a double integrator, which enters as 1/m.

        ValueError: the vertices differ in A. Sampling is nonlinear in A, so that the hull of sampled vertices does not
        contain the sampled systems between them; enclose the discrete matrices by `of` or `intervals` instead.
        """
        known = _matrices(vertices)
        if any(not np.array_equal(numbers("model_error: A", A), known[0][0]) for A, *_ in known):
            raise ValueError(
                "model_error: sampled: all vertices must have the same A, because exp(A T) is nonlinear in A and the "
                "hull of sampled vertices does not contain the systems between them; give vertices or intervals of the "
                "discrete matrices instead, by ModelError.of or ModelError.intervals"
            )
        systems = [LinearSystem.discretised(A, B, sampling_time, c[0] if c else None) for A, B, *c in known]
        return cls.of([(system.A, system.B, system.c) for system in systems])

    def generators(self, plant: ConstrainedSystem) -> list[Vector]:
        """Return the generators of a zonotope D around 0 that contains the effect of the model's error on a plant.

        ValueError: shapes do not fit, or a state or input without bounds has an uncertain coefficient.
        """
        every: Sequence[LinearSystem | Vertex] = (plant.linear, *self.vertices)
        nominal, *vertices = (subject.Vertex(of.A.tolist(), of.B.tolist(), of.c.tolist()) for of in every)
        try:
            return checked.of_model_error(nominal, vertices, plant.state_set.checked, plant.input_set.checked)
        except FailedStepError as error:
            raise ValueError(f"model_error: {str(error).removeprefix('model: ')}") from error

    def __str__(self) -> str:
        return f"the convex hull of {len(self.vertices)} systems"


def _matrices(vertices: object) -> Sequence[Any]:
    """Return `vertices`, a list of (A, B) or (A, B, c). TypeError: it is empty, or it is no list of these."""
    if not isinstance(vertices, list | tuple) or not vertices:
        raise TypeError(f"model_error: expected a list of vertices, (A, B) or (A, B, c), got {short(vertices)}")
    for i, given in enumerate(vertices):
        if not isinstance(given, list | tuple) or len(given) not in (2, 3):
            raise TypeError(f"model_error: vertex {i + 1}: expected (A, B) or (A, B, c), got {short(given)}")
    return vertices


# Measurement noise and a wrong model, as a larger disturbance.


def disturbances_of_errors(
    plant: ConstrainedSystem, disturbance: DisturbanceSet, noise: Zonotope | None, model_error: ModelError | None
) -> DisturbanceSet:
    """Return a set with every change of the error in one step that disturbance, noise and model error may cause.

    A system with disturbances w(k) ∈ W, whose state is measured as y = x + v with v(k) in the `noise` set V, has
    y⁺ = A y + B u + c + w − A v + v⁺. So the measured state is disturbed by W ⊕ (−A V) ⊕ V. If r y ≤ h − h_V(−r), then
    x = y − v satisfies the bound r x ≤ h. A controller that receives y then keeps x in X and u in U.

    With noise or a `model_error`, all sets are zonotopes. ValueError: a set does not fit the system. TypeError: a set
    or the `model_error` is of another type.
    """
    if noise is None and model_error is None:
        return disturbance
    A, cause = plant.linear.A, "model_error" if noise is None else "measurement_noise"
    W: checker.Zonotope = require_zonotope(f"disturbance, with {cause}", disturbance)
    if noise is not None:
        require_disturbance(noise, len(A), "measurement_noise")
        W = checker.of_measured_state(W, noise, A.tolist())
    if model_error is None:
        return Zonotope(W.centre, W.generators)
    instance("model_error", model_error, ModelError, "a ModelError, such as ModelError.intervals(system, entries)")
    return Zonotope(W.centre, [*W.generators, *model_error.generators(plant)])
