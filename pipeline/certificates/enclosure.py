"""Enclosure of a quantity over a box of time: a Taylor polynomial about its middle, and a bound of what that misses."""

import math
from dataclasses import dataclass

import numpy as np
from flint import arb, arb_poly, arb_series

from pipeline.certificates.balls import ball_arithmetic
from pipeline.certificates.exact import ExactFunctional, ExactQuantity
from pipeline.certificates.growth import on_disc
from pipeline.certificates.models import Enclosure, Models
from pipeline.certificates.series import has_periodic_part, is_analytic, taylor
from pipeline.gp.kernel import Kernel
from pipeline.gp.signal import KernelSum
from pipeline.systems.expression import Variable, evaluate

_BEYOND_HALF = 1.01
_ROOM = 4
"""A checker that bounds what formulas miss a little more crudely still agrees."""

_RATIOS = (1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 16.0, 20.0, 26.0, 32.0, 64.0, 128.0)


@dataclass(frozen=True)
class Box:
    """The real times of [start, end] [s], start < end; `radius` [s] of the discs used in Cauchy's estimate."""

    start: float
    end: float
    radius: float


def remainder(functional: ExactFunctional, box: Box, terms: int) -> arb:
    """Bound of what a Taylor polynomial of so many terms leaves out anywhere in the box; infinite if the disc is small.

    By Cauchy's estimate with |κ| ≤ M on |z − r| < ρ: Σ_(k ≥ terms) |κ⁽ᵏ⁾(r)| hᵏ/k! ≤ M (h/ρ)^terms / (1 − h/ρ). If the
    kink of a Matérn kernel lies in the box, the branch of the box's middle is continued beyond it.
    """
    total = arb(0)
    with ball_arithmetic(2):
        middle, half = _midpoint(box)
        radius = arb(box.radius)
        missed = _geometric_rest(half / radius, terms)
        kernels = {term.signal.kernel for term in functional.terms}
        continued = {kernel: _continued(kernel, half, radius, terms) for kernel in kernels}
        for term, shift, weight in functional.summands():
            kernel, r = term.signal.kernel, middle + shift
            total += abs(weight) * on_disc(kernel, r, radius) * missed
            if not _side(box, shift):
                # A middle of uncertain sign is next to the kink, or else nothing is known.
                known = r > 0 or r < 0 or abs(r) < half / 1000
                total += abs(weight) * (continued[kernel] if known else arb.pos_inf())
        return total


def _continued(kernel: Kernel, half: arb, radius: arb, terms: int) -> arb:
    return arb(0) if is_analytic(kernel) else _oddness(kernel, half * _BEYOND_HALF, radius, terms)


def _geometric_rest(ratio: arb, terms: int) -> arb:
    """Σ_(k ≥ terms) ratioᵏ."""
    return ratio**terms / (1 - ratio) if ratio < 1 else arb.pos_inf()


def _oddness(kernel: Kernel, reach: arb, radius: arb, terms: int) -> arb:
    """Bound of |κ₊(r) − κ₊(−r)| for 0 ≤ r ≤ reach: what continuing the branch κ₊ of r ≥ 0 beyond the kink costs.

    Of (1 + x) e^(−x) the odd powers begin with x³, of Matérn 5/2 with x⁵.
    """
    rest = on_disc(kernel, arb(0), radius) * _geometric_rest(reach / radius, terms)
    with ball_arithmetic(terms):
        odd = taylor(kernel, arb_series([0, reach], prec=terms)).coeffs()[1::2]
        return 2 * (sum((abs(coefficient) for coefficient in odd), arb(0)) + rest)


def enclosure(quantity: ExactQuantity, box: Box, terms: int) -> Enclosure:
    """Polynomial with so many terms, and its remainder. UndefinedError where the quantity may not be defined."""
    arguments = {name: _enclosure(functional, box, terms) for name, functional in quantity.arguments.items()}
    if isinstance(quantity.formula, Variable):
        return arguments[quantity.formula.name]
    with ball_arithmetic(terms):
        found = evaluate(quantity.formula, arguments, Models())
        return Enclosure(found.coefficients, _ROOM * found.remainder)


def _enclosure(functional: ExactFunctional, box: Box, terms: int) -> Enclosure:
    rest = remainder(functional, box, terms)
    with ball_arithmetic(terms):
        middle, half = _midpoint(box)
        polynomial = arb_poly([functional.offset])
        for term, shift, weight in functional.summands():
            r = middle + shift
            # κ is even: differences are mirrored to the branch of r ≥ 0.
            mirror = _side(box, shift) or (1 if r >= 0 else -1)
            series = arb_series([mirror * r, mirror * half], prec=terms)
            polynomial += arb_poly(taylor(term.signal.kernel, series).coeffs()) * weight
        return Enclosure(polynomial, rest)


def best_radius(quantity: ExactQuantity, start: float, end: float, terms: int) -> float:
    """A radius of discs [s] that makes the remainder small in the box [start, end] [s]; any other is valid too."""
    half = (end - start) / 2
    with ball_arithmetic(2):
        signals = _signals(quantity, start + half)
        radii = [half * ratio for ratio in _RATIOS]
        bounds = [
            sum((on_disc(kernel, r, arb(radius)) for kernel, r in signals), arb(0)) * (arb(half) / arb(radius)) ** terms
            for radius in radii
        ]
        sizes = [float(bound.upper()) if bound.is_finite() else math.inf for bound in bounds]
        return radii[sizes.index(min(sizes))]


def _signals(quantity: ExactQuantity, middle: float) -> list[tuple[Kernel, arb]]:
    """The kernel of each signal, and how far the nearest centre is [s]; of a repeating kernel some crest always is."""
    shifts: dict[int, tuple[KernelSum, list[float]]] = {}
    for term in quantity.terms:
        shifts.setdefault(id(term.signal), (term.signal, []))[1].append(float(term.shift))
    found = []
    for signal, looks in shifts.values():
        nearest = float(np.min(np.abs(middle + np.array(looks)[:, None] - signal.centres)))
        found.append((signal.kernel, arb(0) if has_periodic_part(signal.kernel) else arb(nearest)))
    return found


def _midpoint(box: Box) -> tuple[arb, arb]:
    return (arb(box.start) + arb(box.end)) / 2, (arb(box.end) - arb(box.start)) / 2


def _side(box: Box, shift: arb) -> int:
    """On which side of zero t + shift certainly stays for all t in the box: −1, 1, or 0 where on neither."""
    if arb(box.start) + shift >= 0:
        return 1
    return -1 if arb(box.end) + shift <= 0 else 0
