"""Bounds of the error of evaluating polynomial pieces in twice the precision (`systems.flat.precise`)."""

from itertools import pairwise
from math import inf, nextafter

from flint import fmpq

from trackable.certificates.pieces.cells import ExactPieces, cells, exactly, rational
from trackable.certificates.rounding.rows import absolute_weights, rows
from trackable.systems.flat.functional import Functional
from trackable.systems.reference import Reference

_UNIT, _TINY = fmpq(1, 2**53), fmpq(1, 2**300)
_LATEST, _PERIODS = 1e60, 2.0**49
_SLACK = fmpq(102, 100)  # for all that is of higher order


def evaluated_until(reference: Reference) -> float:
    """Return the time [s] up to which evaluation is claimed: whole periods have to be counted in float64.

    Beside, times that are far larger than the breakpoints are far beyond any use.
    """
    periods = [signal.period for signal in reference.pieces if signal.beyond == "period"]
    return min([_LATEST, *(_PERIODS * period for period in periods)])


def evaluation_errors(reference: Reference, start: float, end: float) -> dict[str, float]:
    """Bound |float64 − exact| of each bounded quantity at all times from `start` to `end` [s], rounded up.

    "exact" means the value at the float64 t itself, or at the exact k T_s of a step k. A quantity Σ_i r_i x_i is made
    of states or inputs x_i, each of which is rounded once. Where p of the r_i are not zero, its error is
    (p + 4) u Σ_i |r_i x_i|, beside 100 (n + N + 2) u² G, where G is the sum of all absolute terms, as if none
    cancelled (`PreciseFunctionals`). Times are not rounded, so that it does not matter whether pieces meet. A single
    |r_1 x_1| is no larger than its bounds, as far as these are proved.
    """
    signals = tuple(map(ExactPieces, reference.pieces))
    largest = list(map(_largest_terms, signals))
    shifted = sum(order + 1 for order in reference.plant.flatness.orders)
    operations = 100 * (max(signal.degree for signal in reference.pieces) + shifted + 2)
    found = {}
    for row, limit in zip(rows(reference.plant), reference.plant.constraints, strict=True):
        weights, offset = absolute_weights([w for w, _ in row.used], row.functionals)
        gross = sum((rational(w) * value for w, value in zip(weights, largest, strict=True)), rational(offset))
        size = max(abs(exactly(end)) for end in (limit.bounds.lower, limit.bounds.upper))
        if len(row.used) > 1:
            sizes = (_size(part, signals, exactly(start), exactly(end)) for part in row.functionals)
            size = sum((abs(rational(w)) * of_part for (w, _), of_part in zip(row.used, sizes, strict=True)), fmpq(0))
        error = _SLACK * ((len(row.used) + 4) * _UNIT * size + operations * _UNIT**2 * gross)
        error += _TINY * (1 + sum(map(rational, weights), fmpq(0)))  # underflows
        found[row.name] = nextafter(int(error.p) / int(error.q), inf)
    return found


def _size(part: Functional, signals: tuple[ExactPieces, ...], start: fmpq, end: fmpq) -> fmpq:
    """Over-estimate |x_i| by the sums of absolute coefficients in each cell."""
    found = cells(part, signals, start, end)
    return max(sum(map(abs, cell.polynomial.coeffs()), fmpq(0)) for cell in found)


def _largest_terms(signal: ExactPieces) -> fmpq:
    """Return the largest Σ_j |c_ij| (t_(i+1) − t_i)^j."""
    return max(
        sum((exactly(abs(c)) * (end - start) ** j for j, c in enumerate(row)), fmpq(0))
        for (start, end), row in zip(pairwise(signal.ends), signal.signal.coefficients.tolist(), strict=True)
    )
