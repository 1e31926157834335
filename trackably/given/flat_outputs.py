"""From curves of states to the flat outputs of a sampled system, and how far its states are from the curves then."""

from fractions import Fraction
from math import inf, nextafter

import numpy as np
from numpy.polynomial import Polynomial

from trackably.arrays import Array
from trackably.certificates.claim import Claim
from trackably.certificates.pieces.cells import ExactPieces, cells, exactly
from trackably.certificates.pieces.extremes import Search
from trackably.gp.stencil import Stencil
from trackably.systems.flat.functional import Functional
from trackably.systems.signals.pieces import PolynomialPieces

_DIGITS = 1e-9  # of a distance, and of the size of the curve


def flat_output(curve: PolynomialPieces, stencil: Stencil, order: int, step: float) -> PolynomialPieces:
    """Return the flat output z that is nearest, to second order in the step [s], to showing a curve p by a stencil.

    The stencil shows y(t) = offset + Σ_j w_j z(t + j step), which is g z(t + τ) + offset up to second derivatives, with
    the gain g = Σ w_j and the delay τ = Σ j w_j step/g. So z(t) = (p(t − τ) − offset)/g. A curve that ends is continued
    by its first piece to where it begins itself, and by its last one for the `order` steps that inputs look ahead.
    """
    gain = sum(stencil.weights)
    delay = sum(j * w for j, w in enumerate(stencil.weights)) / gain * step
    ends, coefficients = curve.breakpoints + delay, curve.coefficients / gain
    if curve.beyond == "period":
        ends = _repeating(curve, delay)
    elif curve.beyond == "end":
        coefficients[0] = _moved(coefficients[0], float(curve.breakpoints[0] - ends[0]))
        ends[0] = curve.breakpoints[0]
        ends[-1] = max(ends[-1], nextafter(nextafter(curve.breakpoints[-1] + order * step, inf), inf))
    coefficients[:, 0] -= stencil.offset / gain
    return PolynomialPieces(ends, coefficients, curve.beyond)


def _repeating(curve: PolynomialPieces, delay: float) -> Array:
    """Return later breakpoints with the same period: those of the curve itself where float64 has no such numbers."""
    ends = curve.breakpoints + delay
    coarse = 4 * np.spacing(np.max(np.abs(ends)))  # multiples of this have differences that are exact
    ends[0] = np.round(ends[0] / coarse) * coarse
    ends[-1] = ends[0] + curve.period
    exact = Fraction(float(ends[-1])) - Fraction(float(ends[0])) == Fraction(curve.period)
    return ends if exact and np.all(np.diff(ends) > 0) else curve.breakpoints


def _moved(coefficients: Array, by: float) -> Array:
    """Return the coefficients of p(t + by)."""
    moved = Polynomial(coefficients)(Polynomial([by, 1.0])).coef if by else coefficients
    return np.asarray(np.pad(moved, (0, len(coefficients) - len(moved))))


def distance(curve: PolynomialPieces, output: PolynomialPieces, stencil: Stencil, step: float, claim: Claim) -> float:
    """Return the largest distance of what the stencil shows from the curve, at the times of a claim; rounded up."""
    shown = tuple(Fraction(w) for w in stencil.weights)
    apart = Functional((shown, (Fraction(-1),)), Fraction(stencil.offset), step)
    first, last = claim.span
    start = max(first, 0.0) if curve.beyond != "end" else first
    end = last if last < inf else max(float(z.breakpoints[-1]) for z in (curve, output))
    if curve.beyond == "period":
        end = start + curve.period
    found = list(cells(apart, (ExactPieces(output), ExactPieces(curve)), exactly(start), exactly(end)))
    near = exactly(_DIGITS * max(map(_size, (curve, output))) or 1.0)
    most = max(Search(found, sign).to(near).at_most for sign in (1, -1))
    return nextafter(int(most.p) / int(most.q), inf) if most > 0 else 0.0


def _size(curve: PolynomialPieces) -> float:
    """Return a bound of |z|; zero for the zero curve only."""
    powers = np.diff(curve.breakpoints)[:, None] ** np.arange(curve.degree + 1)
    return float(np.max(np.sum(np.abs(curve.coefficients) * powers, axis=1)))
