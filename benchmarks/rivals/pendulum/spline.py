"""Splines of degree five on equal intervals of [0, 1], with rational coefficients: nothing is rounded."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import comb, factorial

from benchmarks.rivals.judge.polynomials import Pieces, Polynomial
from benchmarks.rivals.pendulum.statement import Facts, facts

DEGREE = 5


def _cardinal() -> tuple[Polynomial, ...]:
    """Return the pieces on which B-splines overlap: coefficient j of those that are not zero multiplies piece j."""
    pieces = []
    for j in range(DEGREE + 1):
        # The B-spline is Σ_k (−1)ᵏ C(n+1, k) (t − k)₊ⁿ/n!; its piece on [m, m + 1] goes with coefficient n − m.
        m = DEGREE - j
        total = [Fraction(0)] * (DEGREE + 1)
        for k in range(m + 1):
            scale = Fraction((-1) ** k * comb(DEGREE + 1, k), factorial(DEGREE))
            for power in range(DEGREE + 1):
                total[power] += scale * comb(DEGREE, power) * Fraction(m - k) ** (DEGREE - power)
        pieces.append(tuple(total))
    return tuple(pieces)


CARDINAL = _cardinal()


@dataclass(frozen=True)
class Spline:
    """x with `coefficients` (intervals + 5), exact."""

    coefficients: tuple[Fraction, ...]

    @cached_property
    def x(self) -> Pieces:
        """The pieces in seconds."""
        count = len(self.coefficients) - DEGREE
        breaks = tuple(Fraction(i, count) for i in range(count + 1))
        parts = []
        for i in range(count):
            around = self.coefficients[i : i + DEGREE + 1]
            sums = [sum((c * piece[k] for c, piece in zip(around, CARDINAL, strict=True))) for k in range(DEGREE + 1)]
            parts.append(tuple(Fraction(a) * count**k for k, a in enumerate(sums)))
        return Pieces(breaks, tuple(parts))

    @property
    def w(self) -> Pieces:
        """x″ + 10 x."""
        second = self.x.derivative().derivative()
        longer = (*[Fraction(0)] * 2,)
        parts = [
            tuple(a + 10 * b for a, b in zip((*high, *longer), low, strict=True))
            for high, low in zip(second.parts, self.x.parts, strict=True)
        ]
        return Pieces(self.x.breaks, tuple(parts))

    @property
    def effort(self) -> float:
        """∫ u², exactly and then rounded."""
        w, total = self.w.derivative(), Fraction(0)
        for start, end, part in zip(w.breaks[:-1], w.breaks[1:], w.parts, strict=True):
            for i, a in enumerate(part):
                for j, b in enumerate(part):
                    total += a * b * (end - start) ** (i + j + 1) / (i + j + 1)
        return float(total)

    def residuals(self) -> tuple[Fraction, ...]:
        """Return what is missing in x(0) = 1/2, x′(0) = 0, w(0) = 0, x(1/3) = 1/2 and x(1) = 0; zero where met."""
        x, first = self.x, self.x.parts[0]
        third = x.parts[len(x.parts) // 3][0]
        last, length = x.parts[-1], x.breaks[-1] - x.breaks[-2]
        end = sum((a * length**k for k, a in enumerate(last)), Fraction(0))
        return (first[0] - Fraction(1, 2), first[1], 2 * first[2] + 10 * first[0], third - Fraction(1, 2), end)

    @property
    def final_speed(self) -> Fraction:
        """x′(1)."""
        speed = self.x.derivative()
        length = speed.breaks[-1] - speed.breaks[-2]
        return sum((a * length**k for k, a in enumerate(speed.parts[-1])), Fraction(0))

    def facts(self) -> Facts:
        """What is proved of it."""
        return facts(self.x.derivative(), self.w, float(self.final_speed))


def exactly(coefficients: tuple[Fraction, ...]) -> Spline:
    """Meet all five equations by the least change of five coefficients: three at the start, one at 1/3, one at 1."""
    moved = list(coefficients)
    intervals = len(moved) - DEGREE
    for which, rows in (((0, 1, 2), (0, 1, 2)), ((intervals // 3 + 2,), (3,)), ((len(moved) - 1,), (4,))):
        base = Spline(tuple(moved)).residuals()
        columns = []
        for j in which:
            bent = list(moved)
            bent[j] += 1
            after = Spline(tuple(bent)).residuals()
            columns.append([after[row] - base[row] for row in rows])
        change = _solved([list(row) for row in zip(*columns, strict=True)], [-base[row] for row in rows])
        for j, by in zip(which, change, strict=True):
            moved[j] += by
    return Spline(tuple(moved))


def _solved(matrix: list[list[Fraction]], right: list[Fraction]) -> list[Fraction]:
    """Solve a small system exactly, by elimination."""
    rows = [[*row, b] for row, b in zip(matrix, right, strict=True)]
    for i in range(len(rows)):
        pivot = next(j for j in range(i, len(rows)) if rows[j][i])
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [value / rows[i][i] for value in rows[i]]
        for j in range(len(rows)):
            if j != i:
                rows[j] = [a - rows[j][i] * b for a, b in zip(rows[j], rows[i], strict=True)]
    return [row[-1] for row in rows]
