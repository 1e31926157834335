"""Disturbances, an extension: bounds of the reference leave room for every error of the disturbed system.

Theorem. The certificate of a linear system may also hold a matrix K, a set W, and sets X₀ and U₀ with the rows of X
and U. Let x_r(t) be the x(t) of the certificate, and u_r(t) its u(t), or u(t) + v(t) if inputs are redundant. If
`check` answers Proved, then for each t₀ of the claimed times, each x(0) = x_r(t₀) + e with e ∈ Z, and each sequence of
w(k) ∈ W, the system x(k + 1) = A x(k) + B u(k) + c + w(k) with u(k) = u_r(t₀ + k T) + K (x(k) − x_r(t₀ + k T)) has
x(k) ∈ X₀ and u(k) ∈ U₀ for all k ≥ 0 with t₀ + k T among the claimed times. The set Z of errors is defined in the
proof; it contains 0 if W does. What rounding adds to a state counts as a part of w.

With measurement noise, the certificate also holds a set V, and the state is measured as y(k) = x(k) + v(k). Then the
same holds for each y(0) = x_r(t₀) + e with e ∈ Z, and all sequences of w(k) ∈ W and v(k) ∈ V, with u(k) =
u_r(t₀ + k T) + K (y(k) − x_r(t₀ + k T)).

Proof. Let F = A + B K. The certificate holds whole numbers N, s ≥ 1, a number 0 ≤ α < 1, and sizes p_i ≥ 0 of a box P
= {x : |x_i| ≤ p_i}. Verified are W ⊆ P, and Fˢ P ⊆ α P: Σ_j |(Fˢ)_ij| p_j ≤ α p_i for all i. Let Y = (1 − α)⁻¹ (P ⊕ F
P ⊕ … ⊕ Fˢ⁻¹ P). Then F Y ⊕ P ⊆ Y: as Fˢ P ⊆ α P and P is convex, F Y ⊕ P is inside of (1 − α)⁻¹ (F P ⊕ … ⊕ Fˢ⁻¹ P ⊕ α
P) ⊕ P = Y. Let Z = W ⊕ F W ⊕ … ⊕ Fᴺ⁻¹ W ⊕ Fᴺ Y. Then F Z ⊕ W ⊆ Z, because it is W ⊕ F W ⊕ … ⊕ Fᴺ⁻¹ W ⊕ Fᴺ (W ⊕ F Y).
The errors e(k) = x(k) − x_r(t₀ + k T) obey e(k + 1) = F e(k) + w(k), so that all of them are in Z. For each row r of
X and its bounds l ≤ r x ≤ h in X and l₀ ≤ r x ≤ h₀ in X₀, verified are h + h_Z(r) ≤ h₀ and l₀ ≤ l − h_Z(−r), with the
support function h_Z(r) = max {r e : e ∈ Z}, which is Σ_{i<N} h_W(r Fⁱ) + (1 − α)⁻¹ Σ_{i<s} Σ_j |(r Fᴺ⁺ⁱ)_j| p_j; and
likewise for each row r of U with h_Z(r K). So r x(k) = r x_r + r e(k) and r u(k) = r u_r + r K e(k) keep the bounds
of X₀ and U₀. Y with W in the place of P is the set of S. V. Raković et al., Invariant approximations of the minimal
robust positively invariant set, 2005.

With V, y(k + 1) = A y(k) + B u(k) + c + w(k) − A v(k) + v(k + 1). So all of this is verified with W ⊕ (−A V) ⊕ V in
the place of W, for the errors y(k) − x_r. As x = y − v, the bounds of X₀ have to be further out than without V: by
h_V(−r) above and by h_V(r) below. Everything is computed in integers over common denominators.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Annotated, ClassVar

from trackably.checker.answers import FailedStepError
from trackably.checker.intervals import exact_dot, in_whole_numbers
from trackably.checker.limits import COORDINATES, MAY_BE_EMPTY, POWERS, ROWS
from trackably.checker.model_error import Vector, of_model_error
from trackably.checker.moving import room
from trackably.checker.subject import FloatVector, LinearSystem, Matrix, Polytope, Subject, Vertex
from trackably.checker.watch import tick


@dataclass(frozen=True)
class Zonotope:
    """{`centre` + Σ_j ξ_j `generators`[j] : |ξ_j| ≤ 1}."""

    centre: Vector
    generators: Annotated[tuple[Vector, ...], ROWS, MAY_BE_EMPTY]
    kind: ClassVar = "zonotope"

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """All vectors that define the set: the centre and the generators."""
        return (self.centre, *self.generators)

    @staticmethod
    def largest(vectors: Sequence[Sequence[int]], row: Sequence[int]) -> int:
        """Return max {row · w} over the zonotope whose centre and generators are `vectors`, scaled to integers."""
        centre, *generators = (product(vector, row) for vector in vectors)
        return centre + sum(map(abs, generators))


@dataclass(frozen=True)
class Hull:
    """The convex hull of `vertices`."""

    vertices: Annotated[tuple[Vector, ...], ROWS]
    kind: ClassVar = "hull"

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """All vectors that define the set: its vertices."""
        return self.vertices

    @staticmethod
    def largest(vectors: Sequence[Sequence[int]], row: Sequence[int]) -> int:
        """Return max {row · w} over the convex hull whose vertices are `vectors`, scaled to integers."""
        return max(product(vector, row) for vector in vectors)


VectorSet = Zonotope | Hull
PowerCount = Annotated[int, POWERS]


@dataclass(frozen=True)
class Robust:
    """Sets X₀ and U₀ that the disturbed system keeps, for all disturbances in a set W.

    `feedback` is K, row by row, and A_K = A + B K. If a `model` is given, (A, B, c) may be any point of its convex
    hull, and another one at each step. If there is `noise` V, K acts on the measured state y = x + v, and the errors
    are those of y, which is disturbed by W ⊕ (−A V) ⊕ V in place of W. The errors stay in
    Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P with N = `head`, s = `terms`, α = `contraction`, and
    P = {|x_i| ≤ p_i} with p = `box`.
    """

    state_set: Polytope
    input_set: Polytope
    feedback: Matrix
    set: VectorSet
    head: PowerCount
    terms: PowerCount
    contraction: float
    box: FloatVector
    noise: VectorSet | None = None
    model: Annotated[tuple[Vertex, ...], COORDINATES] = ()

    def model_generators(self, system: LinearSystem) -> list[Vector]:
        """Return the generators of the set D that a `model` with an error adds to W; none without such a model.

        Raise FailedStepError if W is no zonotope, or if bounds that D needs are missing.
        """
        if self.model and not isinstance(self.set, Zonotope):
            raise FailedStepError(
                "model: the disturbance set W must be a zonotope, not a hull of points, if `model` has vertices"
            )
        return of_model_error(system, self.model, self.state_set, self.input_set) if self.model else []


def of_measured_state(W: Zonotope, V: Zonotope, A: Sequence[Sequence[float]]) -> Zonotope:
    """Return W ⊕ (−A V) ⊕ V, which disturbs the measured state y = x + v."""
    exact = [[Fraction(a) for a in row] for row in A]
    centre, *generators = (tuple(-exact_dot(row, vector) for row in exact) for vector in V.vectors)
    middle = tuple(w + a + v for w, a, v in zip(W.centre, centre, V.centre, strict=True))
    return Zonotope(middle, (*W.generators, *generators, *V.generators))


def product(a: Sequence[int], b: Sequence[int]) -> int:
    """Return the scalar product a · b of two vectors of integers."""
    tick()
    return sum(x * y for x, y in zip(a, b, strict=True))


_MOST_BITS = 2_000_000  # with more bits in a power of A + B K, a certificate is refused: its check would take hours


def check_robust(subject: Subject, robust: Robust | None) -> None:
    """Raise FailedStepError if there is a claim about the disturbed system, but it is not shown.

    The reason is that errors may leave their set Z, or that a bound of X leaves too little room for Z, or a bound of U
    for K Z.
    """
    if robust is None:
        return
    system = subject.system
    assert isinstance(system, LinearSystem), "no other certificate is read that speaks of disturbances"
    _check_dimensions(robust, len(system.states), len(system.inputs))
    errors = _errors_of(system, robust)
    if (robust.head + robust.terms) * errors.whole[0][0].bit_length() > _MOST_BITS:
        raise FailedStepError(
            "disturbance: the check would take hours: powers of A + B K up to head + terms have too many digits"
        )
    _check_invariant(robust, errors)
    K = [[Fraction(k) for k in column] for column in zip(*robust.feedback, strict=True)]
    _check_room("state_set", subject.state_set, robust.state_set, errors, robust.noise, None)
    _check_room("input_set", subject.input_set, robust.input_set, errors, None, K)


def keeps_near(system: LinearSystem, robust: Robust, i: int, room: Fraction) -> bool:
    """Return whether state i of the disturbed system is shown to stay within `room` of the reference.

    This holds if h_Z(±r) + h_V(∓r) ≤ room for the row r with x_i = r · x. Here h is the support function of the set Z
    of errors, or of the noise set V.
    """
    errors = _errors_of(system, robust)
    sides = ([Fraction(sign * (i == j)) for j in range(len(system.states))] for sign in (1, -1))
    return all(errors.fit(row, room, robust.noise) for row in sides)


def support_of(W: VectorSet | None, row: Sequence[Fraction]) -> Fraction:
    """Return h_W(row) = max {row · w : w ∈ W}; 0 without a set."""
    if W is None:
        return Fraction(0)
    (r, (moved,)), (d, vectors) = in_whole_numbers([row]), in_whole_numbers(W.vectors)
    return Fraction(W.largest(vectors, moved), r * d)


def _errors_of(system: LinearSystem, robust: Robust) -> "Errors":
    """Return the set Z of the errors of a disturbed system.

    Raise FailedStepError if the effect of its model error, a set D of further disturbances, or that of noise cannot be
    bounded.
    """
    W, V, added = robust.set, robust.noise, robust.model_generators(system)
    if V:
        if not (isinstance(W, Zonotope) and isinstance(V, Zonotope)):
            raise FailedStepError("disturbance: if noise is given, both sets must be zonotopes, not hulls")
        W = of_measured_state(W, V, system.A)
    if isinstance(W, Zonotope):
        W = replace(W, generators=(*W.generators, *added))
    of_Z = robust.head, robust.terms, robust.contraction, robust.box
    return Errors(system.A, system.B, robust.feedback, W, *of_Z)


@dataclass(frozen=True)
class Errors:
    """The set Z of errors e with e(k + 1) = (A + B K) e(k) + w(k) and w(k) in the set `disturbance` (`Robust`).

    Its numbers are written as integers over common denominators.
    """

    A: Matrix
    B: Matrix
    K: Matrix
    disturbance: VectorSet
    head: int
    terms: int
    contraction: float
    box: Sequence[float]

    @cached_property
    def whole(self) -> list[tuple[int, list[list[int]]]]:
        """Three pairs of a common denominator and integers: q and q (A + B K), d and d W, b and b p.

        W stands for the vectors of the `disturbance` as rows, and p, a single row, is the `box`.
        """
        A, B, K = ([[Fraction(v) for v in row] for row in of] for of in (self.A, self.B, self.K))
        columns = list(zip(*K, strict=True))
        closed = [
            [a + exact_dot(inputs, column) for a, column in zip(row, columns, strict=True)]
            for row, inputs in zip(A, B, strict=True)
        ]
        return [*map(in_whole_numbers, (closed, self.disturbance.vectors, [[*map(Fraction, self.box)]]))]

    def support(self, row: Sequence[Fraction]) -> tuple[int, int]:
        """Return the support function h_Z(row) = max {row · e : e ∈ Z}, as numerator and denominator.

        It is Σ_{i<N} h_W(row A_Kⁱ) + (1 − α)⁻¹ Σ_{i<s} h_P(row A_Kᴺ⁺ⁱ), with the symbols of `Robust`. Both sums are
        evaluated by Horner's rule in 1/q, where q is the common denominator of A_K = A + B K. Common factors are not
        cancelled, because this would take far longer than everything else: the sums have as many digits as the last
        power.
        """
        N, s, left = self.head, self.terms, 1 - Fraction(self.contraction)
        ((q, _), (d, vectors), (b, (sizes,))), (r, (moved,)) = self.whole, in_whole_numbers([row])
        of_W = of_P = 0
        for i in range(N + s):
            tick()
            if i < N:
                of_W = of_W * q + self.disturbance.largest(vectors, moved)
            else:
                of_P = of_P * q + product([abs(x) for x in moved], sizes)
            moved = self.moved(moved)
        # `row` was multiplied by r. So h_Z(row) = of_W/(r qᴺ⁻¹ d) + of_P/(r qᴺ⁺ˢ⁻¹ b (1 − α)).
        above = of_W * q**s * b * left.numerator + of_P * d * left.denominator
        return above, r * q ** (N + s - 1) * b * d * left.numerator

    def fit(self, row: Sequence[Fraction], room: Fraction, V: VectorSet | None) -> bool:
        """Return whether row · (e − v) ≤ room for all errors e ∈ Z and, with noise, all v ∈ V."""
        (above, below), left = self.support(row), room - support_of(V, [-r for r in row])
        return above * left.denominator <= left.numerator * below

    def moved(self, row: Sequence[int]) -> list[int]:
        """Return row · q (A + B K), a row of integers, where q is the common denominator of A + B K."""
        return [product(row, column) for column in zip(*self.whole[0][1], strict=True)]


def _check_dimensions(robust: Robust, n: int, m: int) -> None:
    if [len(row) for row in robust.feedback] != [n] * m:
        raise FailedStepError(f"disturbance: K (`feedback`) must have {m} rows, for inputs, of {n} numbers, for states")
    vectors = (*robust.set.vectors, *(robust.noise.vectors if robust.noise else ()), robust.box)
    if any(len(vector) != n for vector in vectors):
        lengths = " and ".join(str(length) for length in sorted({*map(len, vectors)}))
        raise FailedStepError(
            "disturbance: all vectors of W (`set`), V (`noise`) and P (`box`) must have an entry for each state, "
            f"{n} together, got vectors with {lengths} entries"
        )
    dimensions = robust.state_set.dimension, robust.input_set.dimension
    if dimensions != (n, m):
        raise FailedStepError(
            "disturbance: X (`state_set`) and U (`input_set`) must have the dimensions of state and input, "
            f"{n} and {m}, got {dimensions[0]} and {dimensions[1]}"
        )
    if not 0 <= robust.contraction < 1 or min(robust.box) < 0:
        raise FailedStepError(
            "disturbance: the contraction must be at least 0 and less than 1, and P (`box`) must have sizes of "
            f"at least 0, got {robust.contraction!r} and {min(robust.box)!r}"
        )


def _check_invariant(robust: Robust, errors: Errors) -> None:
    """Raise FailedStepError unless W ⊆ P and A_Kˢ P ⊆ α P (`Robust`), so that errors stay in Z."""
    (q, _), (d, vectors), (b, (sizes,)) = errors.whole
    for i, size in enumerate(robust.box):
        axis = [int(i == j) for j in range(len(sizes))]
        supports = (errors.disturbance.largest(vectors, side) for side in (axis, [-a for a in axis]))
        if Fraction(max(supports), d) > size:
            raise FailedStepError(
                f"disturbance: W, with noise and model error, is not inside of P: coordinate {i} exceeds {size!r} of "
                "`box`"
            )
        power = axis
        for _ in range(robust.terms):
            tick()
            power = errors.moved(power)
        reached, allowed = product([abs(x) for x in power], sizes), Fraction(robust.contraction) * Fraction(size)
        if reached * allowed.denominator > allowed.numerator * q**robust.terms * b:
            raise FailedStepError(
                f"disturbance: (A + B K)^{robust.terms} does not contract P in coordinate {i} by the factor "
                f"{robust.contraction!r}"
            )


def _check_room(
    name: str,
    left: Polytope,
    given: Polytope,
    errors: Errors,
    V: VectorSet | None,
    K: list[list[Fraction]] | None,
) -> None:
    """Raise FailedStepError unless all bounds leave enough room for errors.

    `left` has the bounds that the reference keeps, and `given` those that the disturbed system has to keep. For inputs,
    `K` is given by its columns; for states, `K` is None, and `V` is the noise, if there is noise.
    """
    if [row.row for row in left.rows] != [row.row for row in given.rows]:
        raise FailedStepError(f"disturbance: {name} must have the same rows as that of the reference")
    for i, (inner, outer) in enumerate(zip(left.rows, given.rows, strict=True)):
        row = inner.row if K is None else [exact_dot(inner.row, column) for column in K]
        above, below = room(outer.high, inner.high), room(inner.low, outer.low)
        if above is None or below is None:
            raise FailedStepError(
                f"disturbance: {name}: row {i} may differ from that of the reference by a constant only, at all times"
            )
        if not (errors.fit(row, above, V) and errors.fit([-r for r in row], below, V)):
            raise FailedStepError(
                f"disturbance: {name}: row {i} of the reference leaves less room than tracking errors may need"
            )
