"""Exact matrices of rationals; a float64 number enters as the rational that it is."""

from fractions import Fraction

import numpy as np
from flint import fmpq, fmpq_mat

from trackably.arrays import Array


def exact(matrix: Array) -> fmpq_mat:
    """Convert a float64 matrix to rationals, exactly."""
    fractions = [Fraction(v) for v in matrix.ravel().tolist()]
    rows, columns = matrix.shape
    return fmpq_mat(rows, columns, [fmpq(f.numerator, f.denominator) for f in fractions])


def fraction(number: fmpq) -> Fraction:
    """Convert to Python's type of rationals."""
    return Fraction(int(number.p), int(number.q))


def rounded(matrix: fmpq_mat) -> Array:
    """Round each entry to the nearest float64."""
    rows, columns = matrix.nrows(), matrix.ncols()
    return np.array([[float(fraction(matrix[i, j])) for j in range(columns)] for i in range(rows)])


def row_of(matrix: fmpq_mat, i: int) -> fmpq_mat:
    """Return row i as a matrix of one row."""
    return fmpq_mat(1, matrix.ncols(), [matrix[i, j] for j in range(matrix.ncols())])


def columns_of(matrix: fmpq_mat, which: list[int]) -> fmpq_mat:
    """Return these columns, in this order."""
    n = matrix.nrows()
    return fmpq_mat(n, len(which), [matrix[i, j] for i in range(n) for j in which])


def stacked(rows: list[fmpq_mat]) -> fmpq_mat:
    """Stack matrices of one row on top of each other."""
    width = rows[0].ncols()
    return fmpq_mat(len(rows), width, [row[0, j] for row in rows for j in range(width)])


def beside(columns: list[fmpq_mat]) -> fmpq_mat:
    """Put matrices of one column beside each other."""
    n = columns[0].nrows()
    return fmpq_mat(n, len(columns), [column[i, 0] for i in range(n) for column in columns])


def kernel(matrix: fmpq_mat) -> list[fmpq_mat]:
    """Return a basis of the null space {v : M v = 0}, as matrices of one column."""
    reduced, rank = matrix.rref()
    n = matrix.ncols()
    pivots = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
    basis = []
    for free in sorted({*range(n)} - {*pivots}):
        entries = [fmpq(0)] * n
        entries[free] = fmpq(1)
        for i, pivot in enumerate(pivots):
            entries[pivot] = -reduced[i, free]
        basis.append(fmpq_mat(n, 1, entries))
    return basis
