"""Compute flat outputs of a sampled system from curves of states, and the distance of its states from the curves."""

from dataclasses import replace
from fractions import Fraction
from math import inf, nextafter

import numpy as np
from numpy.polynomial import Polynomial

from trackably.arrays import Array
from trackably.certificates.claim import Claim
from trackably.certificates.form import encode_subject
from trackably.certificates.pieces import keeps, least_near, times_to_look_at
from trackably.checker.form import subject_of
from trackably.checker.subject import Functional, Pieces
from trackably.gp.stencil import Stencil
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference

_PARTS = tuple(1e-13 * 8.0**k for k in range(16))
"""Allowances, relative to the size of a curve, that are added to a distance found in float64 until it is proved."""


def flat_output(curve: PolynomialPieces, stencil: Stencil, order: int, step: float) -> PolynomialPieces:
    """Return the flat output z whose state, given by a stencil, is closest to a curve p, to second
    order in the step [s].

    The state is y(t) = offset + Σ_j w_j z(t + j step). Up to second derivatives this is g z(t + τ) + offset with the
    gain g = Σ w_j and the delay τ = Σ j w_j step/g. So z(t) = (p(t − τ) − offset)/g. A curve that ends is extended by
    its first piece to its own first time, and by its last piece for the `order` steps that inputs look ahead.
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
    """Return delayed breakpoints with the same period; those of the curve itself if float64 has no such numbers."""
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


def distance(
    curve: PolynomialPieces, output: PolynomialPieces, stencil: Stencil, reference: Reference, claim: Claim
) -> float:
    """Return the largest distance between the stencil's values and the curve at the times of a claim, rounded up.

    The distance is sought in float64, and then verified by the checker's arithmetic.
    """
    first, last = claim.span
    start = max(first, 0.0) if curve.beyond != "end" else first
    end = last if last < inf else max(float(z.breakpoints[-1]) for z in (curve, output))
    if curve.beyond == "period":
        end = start + curve.period
    shown = tuple(Fraction(w) for w in stencil.weights)
    apart = Functional(Fraction(stencil.offset), (shown, (Fraction(-1),)))
    both = tuple(
        Pieces(tuple(z.breakpoints.tolist()), tuple(map(tuple, z.coefficients.tolist())), z.beyond)
        for z in (output, curve)
    )
    subject = replace(subject_of(encode_subject(reference)), pieces=both)
    shifts = reference.plant.sampling_time * np.arange(float(len(shown)))
    times = times_to_look_at((output, curve), shifts, start, end)
    size = max(map(_size, (curve, output))) or 1.0

    def closeness(t: Array) -> Array:
        return -np.abs(stencil.measured(output, t) - curve(t))

    _, seen = least_near(closeness, times, closeness(times))
    for most in (0.0, *(-seen + part * size for part in _PARTS)):
        if keeps(subject, (Fraction(1),), (apart,), (start, end), (-Fraction(most), Fraction(most))):
            return most
    return inf


def _size(curve: PolynomialPieces) -> float:
    """Return a bound of |z|; it is zero only for the zero curve."""
    powers = np.diff(curve.breakpoints)[:, None] ** np.arange(curve.degree + 1)
    return float(np.max(np.sum(np.abs(curve.coefficients) * powers, axis=1)))
