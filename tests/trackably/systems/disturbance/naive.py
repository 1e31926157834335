"""Second implementations, as the definitions read: slow, and of few thoughts."""

from fractions import Fraction
from itertools import product

import numpy as np

from trackably.systems.disturbances import ConvexHull, DisturbanceSet
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
    A, B, K = (
        [[Fraction(v) for v in line] for line in matrix.tolist()] for matrix in (Z.system.A, Z.system.B, Z.feedback)
    )
    n = len(A)
    A_K = [[A[i][j] + sum(B[i][a] * K[a][j] for a in range(len(K))) for j in range(n)] for i in range(n)]
    sum_over_W = sum_over_P = Fraction(0)
    for i in range(Z.head + Z.terms):
        if i < Z.head:
            sum_over_W += exact_support(Z.disturbance, row)
        else:
            sum_over_P += sum((abs(r) * Fraction(p) for r, p in zip(row, Z.box.tolist(), strict=True)), Fraction(0))
        row = [sum((row[i] * A_K[i][j] for i in range(n)), Fraction(0)) for j in range(n)]
    return sum_over_W + sum_over_P / (1 - Fraction(Z.contraction))


def dot(a, b) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))
