"""Second implementations, as the definitions read: slow, and of few thoughts."""

from fractions import Fraction
from itertools import product

import numpy as np

from trackably.systems.disturbances import ConvexHull, DisturbanceSet
from trackably.systems.rationals import exact
from trackably.systems.tightening import InvariantSet


def extremes(bounded: DisturbanceSet) -> np.ndarray:
    """Points of a set, one in each row, among which its vertices are."""
    if isinstance(bounded, ConvexHull):
        return bounded.matrix
    signs = np.array(list(product([-1, 1], repeat=len(bounded.generators))))
    return bounded.matrix[0] + signs @ bounded.matrix[1:]


def exact_support(bounded: DisturbanceSet, row: list[Fraction]) -> Fraction:
    if isinstance(bounded, ConvexHull):
        return max(dot(row, vertex) for vertex in bounded.vertices)
    return dot(row, bounded.centre) + sum((abs(dot(row, of)) for of in bounded.generators), Fraction(0))


def naive_support(Z: InvariantSet, row: list[Fraction]) -> Fraction:
    """h_Z by the powers of A + B K, one matrix product after the other."""
    closed_loop, box = exact(Z.A) + exact(Z.B) @ exact(Z.K), exact(Z.box)
    total = Fraction(0)
    for i in range(Z.head + Z.terms):
        of_P = dot(np.abs(row), box) / (1 - Fraction(Z.contraction))
        total += exact_support(Z.disturbance, row) if i < Z.head else of_P
        row = row @ closed_loop
    return total


def dot(a, b) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))
