"""Exact matrices of rationals; a float64 number enters as the rational that it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from trackably.arrays import Array

_ZERO, _ONE = Fraction(0), Fraction(1)


@dataclass(frozen=True)
class Matrix:
    """A matrix of `entries`, row by row; it has `columns` columns, also where it has no rows."""

    entries: tuple[tuple[Fraction, ...], ...]
    columns: int

    @classmethod
    def of(cls, rows: Sequence[Sequence[Fraction]], columns: int | None = None) -> Matrix:
        """Return the matrix of these rows; without any, it needs the number of `columns`."""
        return cls(tuple(map(tuple, rows)), len(rows[0]) if columns is None else columns)

    @classmethod
    def exact(cls, array: Array) -> Matrix:
        """Convert a float64 matrix to rationals, exactly."""
        return cls.of([[Fraction(v) for v in row] for row in array.tolist()], array.shape[1])

    @classmethod
    def unit(cls, n: int) -> Matrix:
        """Return the unit matrix (n, n)."""
        return cls.of([[Fraction(int(i == j)) for j in range(n)] for i in range(n)], n)

    def __getitem__(self, place: tuple[int, int]) -> Fraction:
        return self.entries[place[0]][place[1]]

    def __len__(self) -> int:
        return len(self.entries)

    def __add__(self, other: Matrix) -> Matrix:
        pairs = zip(self.entries, other.entries, strict=True)
        return Matrix.of([[a + b for a, b in zip(*rows, strict=True)] for rows in pairs], self.columns)

    def __neg__(self) -> Matrix:
        return Matrix.of([[-v for v in row] for row in self.entries], self.columns)

    def __sub__(self, other: Matrix) -> Matrix:
        return self + -other

    def __matmul__(self, other: Matrix) -> Matrix:
        columns = other.transposed.entries
        return Matrix.of(
            [
                [sum((a * b for a, b in zip(row, of, strict=True) if a and b), _ZERO) for of in columns]
                for row in self.entries
            ],
            other.columns,
        )

    def power(self, exponent: int) -> Matrix:
        """Return the product of so many factors."""
        found = Matrix.unit(len(self))
        for _ in range(exponent):
            found = found @ self
        return found

    @property
    def transposed(self) -> Matrix:
        return Matrix.of([[row[j] for row in self.entries] for j in range(self.columns)], len(self))

    def rows_of(self, which: Sequence[int]) -> Matrix:
        """Return these rows, in this order."""
        return Matrix.of([self.entries[i] for i in which], self.columns)

    def columns_of(self, which: Sequence[int]) -> Matrix:
        """Return these columns, in this order."""
        return Matrix.of([[row[j] for j in which] for row in self.entries], len(which))

    @property
    def rounded(self) -> Array:
        """Each entry as the nearest float64."""
        return np.array([[float(v) for v in row] for row in self.entries]).reshape(len(self), self.columns)

    @property
    def rank(self) -> int:
        return len(self.reduced[1])

    @property
    def reduced(self) -> tuple[Matrix, list[int]]:
        """The reduced row echelon form, and the columns of its pivots."""
        rows, pivots = [list(row) for row in self.entries], list[int]()
        for j in range(self.columns):
            top = len(pivots)
            i = next((i for i in range(top, len(rows)) if rows[i][j]), None)
            if i is None:
                continue
            rows[top], rows[i] = rows[i], rows[top]
            factor = 1 / rows[top][j]
            rows[top] = [factor * v if v else v for v in rows[top]]
            for k, row in enumerate(rows):
                if k != top and (by := row[j]):
                    rows[k] = [a - by * b if b else a for a, b in zip(row, rows[top], strict=True)]
            pivots.append(j)
        return Matrix.of(rows, self.columns), pivots

    @property
    def inverse(self) -> Matrix:
        """The inverse. ZeroDivisionError: there is none."""
        n = len(self)
        reduced, pivots = beside([self, Matrix.unit(n)]).reduced
        if pivots != list(range(n)):
            raise ZeroDivisionError("the matrix is singular")
        return reduced.columns_of(range(n, 2 * n))

    @property
    def null_space(self) -> list[Matrix]:
        """A basis of {v : M v = 0}, as matrices of one column."""
        reduced, pivots = self.reduced
        basis = []
        for free in sorted({*range(self.columns)} - {*pivots}):
            entries = [_ZERO] * self.columns
            entries[free] = _ONE
            for i, pivot in enumerate(pivots):
                entries[pivot] = -reduced[i, free]
            basis.append(Matrix.of([[v] for v in entries], 1))
        return basis


def stacked(parts: Sequence[Matrix]) -> Matrix:
    """Stack matrices on top of each other."""
    return Matrix.of([row for part in parts for row in part.entries], parts[0].columns)


def beside(parts: Sequence[Matrix]) -> Matrix:
    """Put matrices beside each other."""
    rows = zip(*(part.entries for part in parts), strict=True)
    return Matrix.of([[v for row in of for v in row] for of in rows], sum(part.columns for part in parts))
