"""What a certificate says of a disturbed system: a disturbance set, a feedback, and the errors that they allow."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from trackably.checker.arithmetic.intervals import exact_sum
from trackably.checker.subject import Polytope
from trackably.checker.watch import tick

Vector = tuple[Fraction, ...]


@dataclass(frozen=True)
class Zonotope:
    """{`centre` + Σ_j ξ_j `generators`[j] : |ξ_j| ≤ 1}."""

    centre: Vector
    generators: tuple[Vector, ...]

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """All vectors of which the set is made."""
        return (self.centre, *self.generators)

    @staticmethod
    def support(vectors: Sequence[Sequence[int]], row: Sequence[int]) -> int:
        """Return max row · w over the set that is made of these `vectors`, whole multiples of its own."""
        centre, *generators = (product(vector, row) for vector in vectors)
        return centre + sum(map(abs, generators))


@dataclass(frozen=True)
class Hull:
    """The convex hull of `vertices`."""

    vertices: tuple[Vector, ...]

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """All vectors of which the set is made."""
        return self.vertices

    @staticmethod
    def support(vectors: Sequence[Sequence[int]], row: Sequence[int]) -> int:
        """Return max row · w over the set that is made of these `vectors`, whole multiples of its own."""
        return max(product(vector, row) for vector in vectors)


@dataclass(frozen=True)
class Robust:
    """Sets X and U for which the bounds of a certificate leave room, whatever disturbances of a set W do.

    `feedback` is K, row by row. Where there is `noise` V, K is given the measured state y = x + v, and the errors are
    those of y, which W ⊕ (−A V) ⊕ V disturbs instead of W. The errors stay in
    Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P with N = `head`, s = `terms`, α = `contraction`, and
    P = {|x_i| ≤ p_i} of p = `box`.
    """

    state_set: Polytope
    input_set: Polytope
    feedback: tuple[tuple[float, ...], ...]
    disturbance: Zonotope | Hull
    noise: Zonotope | None
    head: int
    terms: int
    contraction: float
    box: tuple[float, ...]


def of_measured_state(W: Zonotope, V: Zonotope, A: Sequence[Sequence[float]]) -> Zonotope:
    """Return W ⊕ (−A V) ⊕ V."""
    exact = [[Fraction(a) for a in row] for row in A]
    centre, *generators = (
        tuple(-exact_sum(a * x for a, x in zip(row, vector, strict=True)) for row in exact) for vector in V.vectors
    )
    middle = tuple(w + a + v for w, a, v in zip(W.centre, centre, V.centre, strict=True))
    return Zonotope(middle, (*W.generators, *generators, *V.generators))


def product(a: Sequence[int], b: Sequence[int]) -> int:
    """Return a · b."""
    found = 0
    for x, y in zip(a, b, strict=True):
        tick()
        found += x * y
    return found
