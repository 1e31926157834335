"""Measurement noise as a disturbance of the state that is measured."""

from dataclasses import replace
from fractions import Fraction

from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.disturbance.rationals import Vector, float_below
from trackable.systems.disturbance.sets import checked
from trackable.systems.disturbance.zonotope import Zonotope
from trackable.systems.sets.polytope import Polytope


def measured(plant: ConstrainedSystem, disturbance: Zonotope, noise: Zonotope) -> tuple[ConstrainedSystem, Zonotope]:
    """Return the plant and the disturbance set of the measured state y = x + v, with v(k) in the set V of `noise`.

    It obeys y⁺ = A y + B u + c + w − A v + v⁺, so that the set is W ⊕ (−A V) ⊕ V. The bounds of the state set are drawn
    in by V: where y keeps them, x = y − v keeps the given ones. A controller that is given y then keeps x in X and u in
    U. Raises ValueError where the system is not linear, a set does not fit it, or V leaves nothing of the state set.
    """
    system = plant.linear
    for of in (disturbance, noise):
        checked(of, len(system.A))
    A = [[Fraction(a) for a in row] for row in system.A.tolist()]
    moved = [tuple(-x for x in _times(A, g)) for g in noise.generators]
    centre = [w - a + v for w, a, v in zip(disturbance.centre, _times(A, noise.centre), noise.centre, strict=True)]
    return (
        replace(plant, state_set=_drawn_in(plant.state_set, noise)),
        Zonotope(centre, [*disturbance.generators, *moved, *noise.generators]),
    )


def _times(A: list[list[Fraction]], vector: Vector) -> Vector:
    return tuple(sum((a * v for a, v in zip(row, vector, strict=True)), Fraction(0)) for row in A)


def _drawn_in(bounded: Polytope, noise: Zonotope) -> Polytope:
    """Return {y : y − v in the set for all v in V}."""
    lower, upper = [], []
    for row, interval in bounded.intervals:
        exact = [Fraction(r) for r in row.tolist()]
        lower.append(-float_below(-(Fraction(interval.lower) + _support(noise, exact))))
        upper.append(float_below(Fraction(interval.upper) - _support(noise, [-r for r in exact])))
    return Polytope(bounded.rows, lower, upper, bounded.dimension)


def _support(of: Zonotope, row: list[Fraction]) -> Fraction:
    """Return h_V(row), exactly."""
    centre, *parts = (
        sum((r * x for r, x in zip(row, vector, strict=True)), Fraction(0)) for vector in (of.centre, *of.generators)
    )
    return centre + sum(map(abs, parts), Fraction(0))
