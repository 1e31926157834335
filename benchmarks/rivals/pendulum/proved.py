"""A trajectory of the pendulum that is proved to keep its bounds for all t in [0, 1].

x is a flat output: w = x″ + 10 x and u = w′. It is taken as a spline of degree five on equal intervals: the bounds of
x′ and w are asked of Bernstein coefficients, which enclose each piece, and the coefficients that are found are rounded
to rationals that meet the five equations exactly. What is then proved is about these rationals, with no rounding.
"""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import comb, factorial

import numpy as np
import scipy

from benchmarks.rivals.adapters.conic import Conic, Unsolved
from benchmarks.rivals.judge.polynomials import Pieces, Polynomial, bernstein, halved
from benchmarks.rivals.pendulum.statement import EFFORT, LEAST_SPEED, MOST_W, REWARD, Facts, facts
from trackably.systems.rationals import inverse

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
        change = inverse(np.array(columns, dtype=object).T) @ np.array([-base[row] for row in rows], dtype=object)
        for j, by in zip(which, change, strict=True):
            moved[j] += by
    return Spline(tuple(moved))


_HALVINGS = 2  # of each interval, so that Bernstein coefficients lie close to their polynomial
_KEPT_FREE = 1e-5  # of either bound, for the equations that are met exactly afterwards


def solve(intervals: int = 240) -> Spline | Unsolved:
    """Find the best spline on as many intervals, a multiple of three, and meet the equations exactly."""
    if intervals % 3:
        raise ValueError(f"intervals: a multiple of 3 puts a knot at 1/3, got {intervals}")
    size = intervals + DEGREE
    speed, w, effort = _operators(intervals)
    G = scipy.sparse.vstack([-speed, w, -w])
    h = np.concatenate(
        [np.full(speed.shape[0], -LEAST_SPEED - _KEPT_FREE), np.full(2 * w.shape[0], MOST_W - _KEPT_FREE)]
    )
    last = np.zeros(size)
    last[-DEGREE - 1 :] = [float(sum(k * a for k, a in enumerate(piece))) * intervals for piece in CARDINAL]
    met = _equations(intervals), np.array([0.5, 0.0, 0.0, 0.5, 0.0])
    found = Conic(2 * EFFORT * effort, -REWARD * last, G, h, met).solve()
    if isinstance(found, Unsolved):
        return found
    return exactly(tuple(Fraction(round(v * 2**60), 2**60) for v in found.x.tolist()))


def _operators(intervals: int) -> tuple[scipy.sparse.sparray, scipy.sparse.sparray, scipy.sparse.sparray]:
    """Return Bernstein coefficients of x′ and of w on parts of all intervals, and the quadratic form of ∫ u²."""
    speed_of, w_of, u_of = [], [], []
    for piece in CARDINAL:
        x = Pieces((Fraction(0), Fraction(1)), (piece,))
        first = [a * intervals for a in x.derivative().parts[0]]
        second = [a * intervals**2 for a in x.derivative().derivative().parts[0]]
        both = [a + 10 * b for a, b in zip((*second, 0, 0), piece, strict=True)]
        speed_of.append(_parts(tuple(first)))
        w_of.append(_parts(tuple(map(Fraction, both))))
        u_of.append([float(k * a) * intervals for k, a in enumerate(both)][1:])
    moments = np.array([[1 / (i + j + 1) for j in range(DEGREE)] for i in range(DEGREE)]) / intervals
    by_piece = np.array(u_of)
    local = by_piece @ moments @ by_piece.T
    # Coefficient j of those that are not zero on an interval is that many places behind the first one.
    behind = [scipy.sparse.eye_array(intervals, intervals + DEGREE, k=j) for j in range(DEGREE + 1)]
    squares = sum(local[i, j] * (one.T @ other) for i, one in enumerate(behind) for j, other in enumerate(behind))
    speed, w = (
        sum(scipy.sparse.kron(shift, np.array(of)[[j]].T) for j, shift in enumerate(behind)) for of in (speed_of, w_of)
    )
    return speed, w, squares


def _parts(polynomial: Polynomial) -> list[float]:
    pieces = [bernstein(polynomial, Fraction(1))]
    for _ in range(_HALVINGS):
        pieces = [half for piece in pieces for half in halved(piece)]
    return [float(b) for piece in pieces for b in piece]


def _equations(intervals: int) -> scipy.sparse.sparray:
    size = intervals + DEGREE
    rows = np.zeros((5, size))
    at = np.array([[float(piece[k]) * intervals**k for piece in CARDINAL] for k in range(3)])
    rows[0, : DEGREE + 1], rows[1, : DEGREE + 1] = at[0], at[1]
    rows[2, : DEGREE + 1] = 2 * at[2] + 10 * at[0]
    rows[3, intervals // 3 : intervals // 3 + DEGREE + 1] = at[0]
    rows[4, -DEGREE - 1 :] = [float(sum(piece)) for piece in CARDINAL]
    return scipy.sparse.csr_array(rows)
