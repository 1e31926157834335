"""Polynomial pieces in float64: the cells in which bounds are certainly kept, for all bounds and cells at once.

The mathematics is that of `piecewise`. Cells and the pieces that hold in them are found in whole numbers. What follows
is linear in a piece's coefficients c_k: those of c(a + b y) for 0 ≤ y ≤ 1, by Horner's rule; weighted sums of these,
one for each bound; and Bernstein coefficients of the sums. So each result is a sum of products. It is computed twice,
as it is, and with the absolute values of all factors. With n coefficients and T terms, no product takes more than K =
4 n + T + 8 roundings of its factors, of itself and of sums. So what is computed is off by 1.1 K u times the sum of the
absolute products at most, with u = 2⁻⁵³ and 10 % for higher orders. Underflow in a step of Horner's rule loses less
than u 2⁻¹⁰⁰⁰, and 2⁻¹⁰⁰⁰ is added to the absolute values in each step; afterwards it loses less than 2⁻¹⁰⁰⁰ in all.

Of joints (`joints`), limits are certainly kept and jumps certainly small by the same coefficients. With M the matrix
from powers of x to Bernstein coefficients, b = M a, and a polynomial lies between the least and the largest entry of b
for 0 ≤ x ≤ 1. Each a_k takes less than k + 8 roundings, an entry of M one, and a sum of n + 1 products n + 1: b is off
by less than (2 n + 20) u |M| |a| ≤ 2⁻⁴⁴ |M| |a| with n < 100, and by 2⁻¹⁰⁰⁰ for what underflows, as h^k does not: it is
between 2⁻⁹⁰⁰ and 2⁹⁰⁰. Where that does not decide, polynomials are halved in float64 intervals.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import groupby
from math import inf, nan, nextafter, perm

import numpy as np

from trackably.checker.floats.intervals import Array, Floats, bernstein, stay_between
from trackably.checker.joints import JointTrajectory, Open, everything
from trackably.checker.moving import place
from trackably.checker.piecewise import exact_times, shifts_of, whole
from trackably.checker.subject import Functional, Pieces, Subject, as_float
from trackably.checker.watch import tick

_COEFFICIENTS = 500_000
"""Coefficients of all terms in the cells that are processed at once, to limit the memory for any file."""

_TINY, _SMALL = 2.0**-1000, 2.0**-500

Cell = tuple[int, int]


def cells_left(
    subject: Subject, rows: Sequence[tuple[Functional, Fraction, Fraction]], cells: Sequence[Cell], bits: int
) -> list[list[Cell]]:
    """Return for each row the cells in which it is not certain to stay between two numbers.

    The times of the cells are in units of 2^−`bits` s. No signal on which a row depends changes its polynomial in a
    cell.
    """
    terms = sorted({term for row, _, _ in rows for term in shifts_of(row)})
    if not terms:
        return [list(cells) for _ in rows]
    n = 1 + max(subject.pieces[s].degree for s, _ in terms)
    at_once = max(1, _COEFFICIENTS // (n * max(len(terms), len(rows))))
    weights = np.array([[_nearest(row.weights[s][j]) for s, j in terms] for row, _, _ in rows])
    offsets = np.array([[_nearest(row.offset)] for row, _, _ in rows])
    least = np.array([nextafter(as_float(low), inf) for _, low, _ in rows])
    most = np.array([nextafter(as_float(high), -inf) for _, _, high in rows])
    found: list[list[Cell]] = [[] for _ in rows]
    with np.errstate(all="ignore"):  # what is not finite is not proved
        for begin in range(0, len(cells), at_once):
            some = cells[begin : begin + at_once]
            c, a, b = _local(subject, terms, n, some, bits)
            values = _sums(c, a, b, weights, offsets, 0.0)
            sizes = _sums(abs(c), abs(a), b, abs(weights), abs(offsets), _TINY)
            off = 1.1 * (4 * n + len(terms) + 8) * 2.0**-53 * sizes + _TINY
            near = Floats(values - off, values + off)
            kept = stay_between(near, *(np.repeat(of, len(some)) for of in (least, most)))
            for left, is_kept in zip(found, kept.reshape(len(rows), -1), strict=True):
                left += [some[k] for k in np.flatnonzero(~is_kept).tolist()]
    return found


def _nearest(number: Fraction) -> float:
    """Return the nearest float64; NaN if its error may exceed one rounding."""
    nearest = as_float(number)
    return nearest if not number or _SMALL < abs(nearest) < 1 / _SMALL else nan


def _local(
    subject: Subject, terms: Sequence[tuple[int, int]], n: int, cells: Sequence[Cell], bits: int
) -> tuple[Array, Array, Array]:
    """Return z_s(t + j T) in each cell as c(a + b y): n coefficients c, (n, T, B), and a and b, (T, B)."""
    step, unit = Fraction(subject.system.sampling_time), 1 << bits
    known: dict[tuple[object, ...], tuple[list[int], list[float], list[float]]] = {}
    coefficients, places = np.zeros((n, len(terms), len(cells))), []
    for s, of_signal in groupby(enumerate(terms), lambda term: term[1][0]):
        z = subject.pieces[s]
        of_pieces = np.array(z.coefficients).T
        for k, (_, j) in of_signal:
            key = (z.breakpoints, z.beyond, j)  # many signals change their polynomials at the same times
            if key not in known:
                known[key] = _places(z, whole(j * step * unit), cells, bits)
            places.append(known[key])
            coefficients[: z.degree + 1, k] = of_pieces[:, known[key][0]]
    a, b = (np.array([place[i] for place in places]).reshape(len(terms), -1) for i in (1, 2))
    return coefficients, a, b


def _places(z: Pieces, shift: int, cells: Sequence[Cell], bits: int) -> tuple[list[int], list[float], list[float]]:
    """Return the index of the piece in each cell, the cell's start in the piece [s], and its length [s]."""
    tick()
    ends, unit = exact_times(z, bits), 1 << bits
    found = [place(z, ends, a + shift, b - a) for a, b in cells]
    starts, widths = ([_time(of[i], unit) for of in found] for i in (1, 2))
    return [i for i, _, _ in found], starts, widths


def _time(units: int, unit: int) -> float:
    """Return a time [s], rounded once; NaN if its error may be larger."""
    time = units / unit
    return time if not units or abs(time) > _SMALL else nan


def _sums(c: Array, a: Array, b: Array, weights: Array, offsets: Array, more: float) -> Array:
    """Return the Bernstein coefficients of the weighted sums in each cell: (n, R B)."""
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
    return bernstein(len(c)) @ rows.reshape(len(c), -1)


_PART, _RANGE = 2.0**-44, 2.0**900


def undecided(trajectory: JointTrajectory) -> tuple[Open, Open]:
    """Return the limits and the jumps that float64 cannot show to be kept."""
    lengths = {len(c) for rows in trajectory.coefficients for c in rows}
    ends = np.array(trajectory.breakpoints)
    widths = np.diff(ends)
    extreme = _RANGE ** (1 / max(lengths))
    if len(lengths) > 1 or not np.all((widths > 1 / extreme) & (widths < extreme)):
        return everything(trajectory)
    with np.errstate(all="ignore"):  # what is not finite is not decided
        c = np.array(trajectory.coefficients)  # joints, pieces, powers
        limits: list[tuple[int, int, int]] = []
        jumps: list[tuple[int, int, int]] = []
        for r in range(len(trajectory.jumps) + 1):
            tick()
            a, b, off = _bernstein(c, widths, r)
            limits += _open_limits(trajectory, r, b, off)
            if r < len(trajectory.jumps):
                jumps += _open_jumps(trajectory, r, a, b, off)
    return limits, jumps


def _bernstein(c: Array, widths: Array, r: int) -> tuple[Array, Array, Array]:
    """Return a_0 on each piece, (J, K), the Bernstein coefficients of a derivative, (J, K, n), and their errors."""
    n = max(c.shape[2] - r, 1)
    powers = c[:, :, r:] if c.shape[2] > r else np.zeros((*c.shape[:2], 1))
    factors = np.array([float(perm(k + r, r)) for k in range(n)])
    a = powers * factors * widths[:, None] ** np.arange(float(n))
    M = bernstein(n)
    return a[:, :, 0], a @ M.T, _PART * (np.abs(a) @ M.T) + _TINY


def _open_limits(trajectory: JointTrajectory, r: int, b: Array, off: Array) -> list[tuple[int, int, int]]:
    some, (joints, pieces, n) = [joint.limits[r] or (-np.inf, np.inf) for joint in trajectory.joints], b.shape
    rest = [(j, r, pieces) for j, (low, high) in enumerate(some) if trajectory.rests and r and not low <= 0 <= high]
    near = Floats((b - off).reshape(-1, n).T, (b + off).reshape(-1, n).T)
    kept = stay_between(near, *(np.repeat(ends, pieces) for ends in zip(*some, strict=True)))
    left = np.argwhere(~kept.reshape(joints, pieces)).tolist()
    return rest + [(j, r, i) for j, i in left if trajectory.joints[j].limits[r]]


def _open_jumps(trajectory: JointTrajectory, r: int, a: Array, b: Array, off: Array) -> list[tuple[int, int, int]]:
    count = len(trajectory.inner)
    rest = np.zeros((len(a), 1)) if r else b[:, -1:, -1]
    after = np.concatenate([a[:, 1:], rest], axis=1)[:, :count]
    jump = np.abs(after - b[:, :count, -1]) * (1 + _PART) + off[:, :count, -1] * 2 + _PART * np.abs(after)
    return [
        (j, r, i + 1)
        for j, i in np.argwhere(~(jump <= trajectory.jumps[r])).tolist()
        if r < trajectory.joints[j].order and not _is_end(trajectory, r, i)
    ]


def _is_end(trajectory: JointTrajectory, r: int, i: int) -> bool:
    """Whether this is the position at the end, which rests there by definition."""
    return r == 0 and i + 2 == len(trajectory.breakpoints)
