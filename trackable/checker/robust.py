"""What a certificate says of a disturbed system: a disturbance set, a feedback, and the errors that they allow."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from trackable.checker.subject import Polytope

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

    `feedback` is K, row by row. The errors stay in Z = ⊕_{i<N} A_Kⁱ W ⊕ A_Kᴺ (1 − α)⁻¹ ⊕_{i<s} A_Kⁱ P with N = `head`,
    s = `terms`, α = `contraction`, and P = {|x_i| ≤ p_i} of p = `box`.
    """

    state_set: Polytope
    input_set: Polytope
    feedback: tuple[tuple[float, ...], ...]
    disturbance: Zonotope | Hull
    head: int
    terms: int
    contraction: float
    box: tuple[float, ...]


def product(a: Sequence[int], b: Sequence[int]) -> int:
    """Return a · b."""
    return sum(x * y for x, y in zip(a, b, strict=True))
