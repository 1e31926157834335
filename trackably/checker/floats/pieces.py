"""Polynomial pieces in float64: the cells in which bounds are certainly kept, for all bounds and cells at once.

The mathematics is that of `piecewise`. Cells and the pieces that hold in them are found in whole numbers. What follows
is linear in a piece's coefficients c_k: those of c(a + b y) for 0 ≤ y ≤ 1, by Horner's rule; weighted sums of these,
one for each bound; and Bernstein coefficients of the sums. So each result is a sum of products. It is computed twice,
as it is, and with the absolute values of all factors. With n coefficients and T terms, no product takes more than K =
4 n + T + 8 roundings of its factors, of itself and of sums. So what is computed is off by 1.1 K u times the sum of the
absolute products at most, with u = 2⁻⁵³ and 10 % for higher orders. Underflow in a step of Horner's rule loses less
than u 2⁻¹⁰⁰⁰, and 2⁻¹⁰⁰⁰ is added to the absolute values in each step; afterwards it loses less than 2⁻¹⁰⁰⁰ in all.

Of joints (`joints`), each derivative is such a sum, and its jump one at a point. A derivative of order r ≤ 4 takes r
more roundings, of k c_k; as a product takes 4 n + T at most, K has room for them.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import groupby
from math import inf, nan, nextafter

import numpy as np

from trackably.checker.floats.intervals import Array, Floats, Mask, bernstein, stay_between
from trackably.checker.joints import JointTrajectory, Open
from trackably.checker.moving import place
from trackably.checker.piecewise import exact_times, whole
from trackably.checker.quantities import shifts_of
from trackably.checker.subject import Functional, Pieces, Subject, as_float
from trackably.checker.watch import tick

_COEFFICIENTS = 500_000
"""Coefficients of all terms in the cells that are processed at once, to limit the memory for any file."""

_TINY, _SMALL = 2.0**-1000, 2.0**-500

Cell = tuple[int, int]


def cells_left(
    subject: Subject, rows: Sequence[tuple[Functional, Fraction, Fraction]], cells: Sequence[Cell], bits: int
) -> list[list[Cell]]:
    """Return, for each row, the cells in which it is not certain to stay between its two numbers.

    `rows` has a weighted sum of signals and its two numbers for each row. The times of `cells` are in units of
    2^−`bits` s. In a cell, no signal on which a row depends changes its polynomial.
    """
    terms = sorted({term for row, _, _ in rows for term in shifts_of(row)})
    if not terms:
        return [list(cells) for _ in rows]
    n = 1 + max(subject.pieces[s].degree for s, _ in terms)
    at_once = max(1, _COEFFICIENTS // (n * max(len(terms), len(rows))))
    weights = np.array([[_nearest(row.weights[s][j]) for s, j in terms] for row, _, _ in rows])
    offsets = np.array([[_nearest(row.offset)] for row, _, _ in rows])
    least = np.array([[nextafter(as_float(low), inf)] for _, low, _ in rows])
    most = np.array([[nextafter(as_float(high), -inf)] for _, _, high in rows])
    found: list[list[Cell]] = [[] for _ in rows]
    for begin in range(0, len(cells), at_once):
        some = cells[begin : begin + at_once]
        kept = _are_kept(*_local(subject, terms, n, some, bits), weights, offsets, least, most)
        for left, is_kept in zip(found, kept, strict=True):
            left += [some[k] for k in np.flatnonzero(~is_kept).tolist()]
    return found


def _are_kept(c: Array, a: Array, b: Array, weights: Array, offsets: Array, least: Array, most: Array) -> Mask:
    """Return which of R weighted sums of T terms c(a + b y) certainly stay between two numbers in each of B cells.

    The sums are compared for 0 ≤ y ≤ 1. The shapes are: c (n, T, B) with n coefficients, a and b (T, B), weights
    (R, T), offsets (R, 1), result (R, B). The numbers `least` and `most` belong to a sum, with the shape (R, 1), or to
    a sum in a cell, with the shape (R, B).
    """
    n, terms, count = c.shape
    with np.errstate(all="ignore"):  # what is not finite is not proved
        values = _sums(c, a, b, weights, offsets, 0.0)
        sizes = _sums(abs(c), abs(a), b, abs(weights), abs(offsets), _TINY)
        off = 1.1 * (4 * n + terms + 8) * 2.0**-53 * sizes + _TINY
        ends = (Floats.exact(np.broadcast_to(end, (len(weights), count)).ravel()) for end in (least, most))
        kept = stay_between(Floats(values - off, values + off), *ends)
    return kept.reshape(len(weights), count)


def _nearest(number: Fraction) -> float:
    """Return the nearest float64; NaN for sizes at which its relative error might exceed 2⁻⁵³."""
    nearest = as_float(number)
    return nearest if not number or _SMALL < abs(nearest) < 1 / _SMALL else nan


def _local(
    subject: Subject, terms: Sequence[tuple[int, int]], n: int, cells: Sequence[Cell], bits: int
) -> tuple[Array, Array, Array]:
    """Return z_s(t + j T), for each (s, j) in `terms` and each cell, as a polynomial c(a + b y) of y from 0 to 1.

    The n coefficients c have the shape (n, T, B) for T terms and B cells; a and b have the shape (T, B).
    """
    step, unit = Fraction(subject.system.sampling_time), 1 << bits
    known: dict[tuple[object, ...], tuple[list[int], list[float], list[float]]] = {}
    coefficients, places = np.zeros((n, len(terms), len(cells))), []
    for s, of_signal in groupby(enumerate(terms), lambda term: term[1][0]):
        z = subject.pieces[s]
        of_pieces = np.array(z.coefficients).T
        for k, (_, j) in of_signal:
            key = (z.breakpoints, z.beyond, j)  # signals with equal breakpoints share their places
            if key not in known:
                known[key] = _places(z, whole(j * step * unit), cells, bits)
            places.append(known[key])
            coefficients[: z.degree + 1, k] = of_pieces[:, known[key][0]]
    a, b = (np.array([place[i] for place in places]).reshape(len(terms), -1) for i in (1, 2))
    return coefficients, a, b


def _places(z: Pieces, shift: int, cells: Sequence[Cell], bits: int) -> tuple[list[int], list[float], list[float]]:
    """Return, for each cell, the index of the piece of z, the time from the piece's start to the cell's start [s],
    and the length of the cell [s], which is 0 where z rests.
    """
    tick()
    ends, unit = exact_times(z, bits), 1 << bits
    found = [place(z, ends, a + shift, b - a) for a, b in cells]
    starts, widths = ([_time(of[i], unit) for of in found] for i in (1, 2))
    return [i for i, _, _ in found], starts, widths


def _time(units: int, unit: int) -> float:
    """Return units/unit [s], rounded once; NaN if its relative error might exceed 2⁻⁵³."""
    time = units / unit
    return time if not units or abs(time) > _SMALL else nan


def _sums(c: Array, a: Array, b: Array, weights: Array, offsets: Array, more: float) -> Array:
    """Return the Bernstein coefficients of R weighted sums in B cells (`_are_kept`), of shape (n, R B).

    `more` is added in each step of Horner's rule. It is tiny if absolute values are summed, so that no underflow makes
    their sum too small; otherwise it is 0.
    """
    found = c[-1:] + more
    for k in reversed(range(len(c) - 1)):
        tick()
        higher = np.empty((len(found) + 1, *a.shape))
        higher[0] = c[k] + a * found[0]
        higher[1:-1] = a * found[1:] + b * found[:-1]
        higher[-1] = b * found[-1]
        found = higher + more
    rows = weights @ found
    rows[0] += offsets
    return bernstein(len(c)) @ rows.reshape(len(c), weights.shape[0] * a.shape[1])


def undecided(trajectory: JointTrajectory) -> tuple[Open, Open]:
    """Return the limits and the jumps that float64 does not show to be kept, with all those of the rest at the end."""
    joints, limits, jumps = trajectory.joints, list[tuple[int, int, int]](), list[tuple[int, int, int]]()
    n = max(len(piece) for pieces in trajectory.coefficients for piece in pieces)
    c = np.array([[[*piece, *[0.0] * (n - len(piece))] for piece in pieces] for pieces in trajectory.coefficients])
    c, no_offset = c.transpose(2, 0, 1), np.zeros((1, 1))  # axes: powers, joints, pieces
    widths = np.diff(trajectory.breakpoints)
    h = np.broadcast_to(np.where(widths > _SMALL, widths, nan), c.shape[1:])
    rest = (0, 0), (0, int(trajectory.rests))  # the rest is one more piece, not decided here
    for r in range(len(trajectory.jumps) + 1):
        tick()
        least, most = np.array([of.limits[r] or (-inf, inf) for of in joints]).repeat(len(widths), axis=0).T
        one, a, b = map(_side_by_side, (c[:, None], 0 * h[None], h[None]))
        kept = np.pad(_are_kept(one, a, b, np.ones((1, 1)), no_offset, least, most).reshape(h.shape), rest)
        limits += [(j, r, i) for j, i in np.argwhere(~kept).tolist() if joints[j].limits[r]]
        if r < len(trajectory.jumps):
            two, at = np.stack([c[..., :-1], c[..., 1:]], axis=1), np.stack([h[:, :-1], 0 * h[:, 1:]])
            two, a, b = map(_side_by_side, (two, at, 0 * at))
            jump = np.array(trajectory.jumps[r])
            kept = _are_kept(two, a, b, np.array([[-1.0, 1.0]]), no_offset, -jump, jump)
            kept = np.pad(kept.reshape(len(joints), -1), rest)
            jumps += [(j, r, i + 1) for j, i in np.argwhere(~kept).tolist() if r < joints[j].order]
        c = np.arange(1.0, len(c))[:, None, None] * c[1:] if len(c) > 1 else 0 * c
    return limits, jumps


def _side_by_side(of: Array) -> Array:
    """Return an array of shape (…, J, K), for K pieces of J joints, in the shape (…, J K) for J K cells."""
    return of.reshape(*of.shape[:-2], -1)
