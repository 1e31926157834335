"""A trajectory of the pendulum that is proved to keep its bounds for all t in [0, 1].

x is a flat output: w = x″ + 10 x and u = w′. It is taken as a spline of degree five on equal intervals: the bounds of
x′ and w are asked of Bernstein coefficients, which enclose each piece, and the coefficients that are found are rounded
to rationals that meet the five equations exactly. What is then proved is about these rationals, with no rounding.
"""

from fractions import Fraction

import numpy as np
import scipy

from benchmarks.rivals.adapters.conic import Conic, Unsolved
from benchmarks.rivals.judge.polynomials import Pieces, Polynomial, bernstein, halved
from benchmarks.rivals.pendulum.spline import CARDINAL, DEGREE, Spline, exactly
from benchmarks.rivals.pendulum.statement import EFFORT, LEAST_SPEED, MOST_W, REWARD
from trackably.arrays import Array

_HALVINGS = 2  # of each interval, so that Bernstein coefficients lie close to their polynomial
_KEPT_FREE = 1e-5  # of either bound, for the equations that are met exactly afterwards


def solve(intervals: int = 240) -> Spline | Unsolved:
    """Find the best spline on as many intervals, a multiple of three, and meet the equations exactly."""
    if intervals % 3:
        raise ValueError(f"intervals: a multiple of 3 puts a knot at 1/3, got {intervals}")
    size = intervals + DEGREE
    speed, w, effort = _operators(intervals)
    equations = _equations(intervals)
    G = scipy.sparse.vstack([-speed, w, -w])
    h = np.concatenate(
        [np.full(speed.shape[0], -LEAST_SPEED - _KEPT_FREE), np.full(2 * w.shape[0], MOST_W - _KEPT_FREE)]
    )
    last = np.zeros(size)
    last[-DEGREE - 1 :] = [float(sum(k * a for k, a in enumerate(piece))) * intervals for piece in CARDINAL]
    program = Conic(
        2 * EFFORT * effort,
        -REWARD * last,
        equations,
        np.array([0.5, 0.0, 0.0, 0.5, 0.0]),
        G,
        h,
    )
    found = program.solve()
    if isinstance(found, Unsolved):
        return found
    return exactly(tuple(Fraction(round(v * 2**60), 2**60) for v in found.x.tolist()))


def _operators(intervals: int) -> tuple[scipy.sparse.sparray, scipy.sparse.sparray, scipy.sparse.sparray]:
    """Return Bernstein coefficients of x′ and of w on parts of all intervals, and the quadratic form of ∫ u²."""
    speed_of, w_of, u_of = [], [], []
    for piece in CARDINAL:
        x = Pieces((Fraction(0), Fraction(1)), (piece,))
        speed = [a * intervals for a in x.derivative().parts[0]]
        second = [a * intervals**2 for a in x.derivative().derivative().parts[0]]
        w = [a + 10 * b for a, b in zip((*second, 0, 0), piece, strict=True)]
        speed_of.append(_parts(tuple(speed)))
        w_of.append(_parts(tuple(map(Fraction, w))))
        u_of.append([float(k * a) * intervals for k, a in enumerate(w)][1:])
    moments = np.array([[1 / (i + j + 1) for j in range(DEGREE)] for i in range(DEGREE)]) / intervals
    by_piece = np.array(u_of)
    local = by_piece @ moments @ by_piece.T
    each = [_placed(local, i, intervals) for i in range(intervals)]
    return _stacked(np.array(speed_of).T, intervals), _stacked(np.array(w_of).T, intervals), sum(each[1:], each[0])


def _parts(polynomial: Polynomial) -> list[float]:
    pieces = [bernstein(polynomial, Fraction(1))]
    for _ in range(_HALVINGS):
        pieces = [half for piece in pieces for half in halved(piece)]
    return [float(b) for piece in pieces for b in piece]


def _stacked(local: Array, intervals: int) -> scipy.sparse.sparray:
    rows = [
        scipy.sparse.hstack(
            [
                scipy.sparse.csr_array((len(local), i)),
                scipy.sparse.csr_array(local),
                scipy.sparse.csr_array((len(local), intervals - 1 - i)),
            ]
        )
        for i in range(intervals)
    ]
    return scipy.sparse.vstack(rows)


def _placed(local: Array, i: int, intervals: int) -> scipy.sparse.sparray:
    return scipy.sparse.block_diag(
        [
            scipy.sparse.csr_array((i, i)),
            scipy.sparse.csr_array(local),
            scipy.sparse.csr_array((intervals - 1 - i, intervals - 1 - i)),
        ],
        format="csr",
    )


def _equations(intervals: int) -> scipy.sparse.sparray:
    size = intervals + DEGREE
    rows = np.zeros((5, size))
    at = np.array([[float(piece[k]) * intervals**k for piece in CARDINAL] for k in range(3)])
    rows[0, : DEGREE + 1], rows[1, : DEGREE + 1] = at[0], at[1]
    rows[2, : DEGREE + 1] = 2 * at[2] + 10 * at[0]
    rows[3, intervals // 3 : intervals // 3 + DEGREE + 1] = at[0]
    rows[4, -DEGREE - 1 :] = [float(sum(piece)) for piece in CARDINAL]
    return scipy.sparse.csr_array(rows)
