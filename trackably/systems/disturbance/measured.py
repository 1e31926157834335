"""Measurement noise: what it does to the state that is measured, and to the bounds of the state."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from trackably.arguments import instance
from trackably.arrays import Array
from trackably.systems.disturbance.rationals import Vector
from trackably.systems.disturbance.sets import DisturbanceSet, checked
from trackably.systems.disturbance.zonotope import Zonotope


@dataclass(frozen=True)
class Measured:
    """Disturbances w(k) ∈ W of a system whose state is measured as y = x + v, with `noise` v(k) ∈ V.

    The measured state obeys y⁺ = A y + B u + c + w − A v + v⁺. So it is disturbed by W ⊕ (−A V) ⊕ V, and x = y − v
    keeps a bound r x ≤ h where r y ≤ h − h_V(−r). A controller that is given y then keeps x in X and u in U.
    """

    disturbance: Zonotope
    noise: Zonotope

    def of_measured_state(self, A: Array) -> Zonotope:
        """Return W ⊕ (−A V) ⊕ V, exactly."""
        W, V = self.disturbance, self.noise
        exact = [[Fraction(a) for a in row] for row in A.tolist()]
        moved = [tuple(-x for x in _times(exact, g)) for g in V.generators]
        centre = [w - a + v for w, a, v in zip(W.centre, _times(exact, V.centre), V.centre, strict=True)]
        return Zonotope(centre, [*W.generators, *moved, *V.generators])

    def support(self, row: Sequence[Fraction]) -> Fraction:
        """Return h_V(row), exactly."""
        vectors = (self.noise.centre, *self.noise.generators)
        centre, *parts = (sum((r * x for r, x in zip(row, of, strict=True)), Fraction(0)) for of in vectors)
        return centre + sum(map(abs, parts), Fraction(0))


def measured(disturbance: DisturbanceSet | None, noise: DisturbanceSet, states: int) -> Measured:
    """Return both sets of a system with so many states; left out, nothing but noise disturbs it.

    TypeError: one is no Zonotope. ValueError: the dimension of one is another, or it does not hold 0.
    """
    W = Zonotope([Fraction(0)] * states) if disturbance is None else disturbance
    for name, of in (("disturbance, with measurement_noise", W), ("measurement_noise", noise)):
        instance(name, of, Zonotope, "a Zonotope, as of Zonotope.box(lower, upper)")
    try:
        checked(noise, states)
    except ValueError as error:
        raise ValueError(f"measurement_noise: {str(error).removeprefix('disturbance: ')}") from None
    checked(W, states)
    assert isinstance(W, Zonotope), "instance has refused anything else"
    assert isinstance(noise, Zonotope), "instance has refused anything else"
    return Measured(W, noise)


def _times(A: list[list[Fraction]], vector: Vector) -> Vector:
    return tuple(sum((a * v for a, v in zip(row, vector, strict=True)), Fraction(0)) for row in A)
