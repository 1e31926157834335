"""Enclose a quantity over a box of time: a Taylor polynomial about its middle, and a bound of what that misses."""

import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from flint import arb, arb_poly

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.models import Enclosure, Models
from trackable.certificates.exact import ExactFunctional, ExactQuantity, Look
from trackable.certificates.kernels.base import Expansion
from trackable.certificates.kernels.table import balls_of
from trackable.systems.formulas.evaluation import evaluate
from trackable.systems.formulas.expression import Variable

_REMEMBERED = 4096  # enclosures of looks: quantities are bisected alike
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
    """Bound what a Taylor polynomial of so many terms leaves out in the box; infinite if the disc is small."""
    with ball_arithmetic(2):
        return sum((abs(weight) * _missed(look, box, terms) for weight, look in functional.terms), arb(0))


@lru_cache(_REMEMBERED)
def _missed(look: Look, box: Box, terms: int) -> arb:
    """Σ_i |c_i| times what the Taylor polynomial of κ(t + s − t_i) leaves out."""
    kernel = balls_of(look.signal.kernel)
    with ball_arithmetic(2):
        middle, half = _midpoint(box)
        expansion = Expansion(half, arb(box.radius), terms)
        return sum(
            (abs(c) * kernel.missed(middle + shift, expansion, _side(box, shift)) for shift, c in look.summands), arb(0)
        )


def enclosure(quantity: ExactQuantity, box: Box, terms: int) -> Enclosure:
    """Return a polynomial with so many terms, and its remainder. UndefinedError where q may not be defined."""
    arguments = {name: _enclosure(functional, box, terms) for name, functional in quantity.arguments.items()}
    if isinstance(quantity.formula, Variable):
        return arguments[quantity.formula.name]
    with ball_arithmetic(terms):
        found = evaluate(quantity.formula, arguments, Models())
        return Enclosure(found.coefficients, _ROOM * found.remainder)


def _enclosure(functional: ExactFunctional, box: Box, terms: int) -> Enclosure:
    with ball_arithmetic(terms):
        polynomial = sum((_polynomial(look, box, terms) * weight for weight, look in functional.terms), arb_poly())
        return Enclosure(polynomial + functional.offset, remainder(functional, box, terms))


@lru_cache(_REMEMBERED)
def _polynomial(look: Look, box: Box, terms: int) -> arb_poly:
    """Σ_i c_i κ(middle + h x + s − t_i), as so many terms of its Taylor series in x."""
    kernel = balls_of(look.signal.kernel)
    with ball_arithmetic(terms):
        middle, half = _midpoint(box)
        expansion, polynomial = Expansion(half, arb(box.radius), terms), arb_poly()
        for shift, c in look.summands:
            polynomial += kernel.polynomial(middle + shift, expansion, _side(box, shift)) * c
        return polynomial


def best_radius(looks: Collection[Look], start: float, end: float, terms: int) -> float:
    """Return a radius of discs [s] that makes remainders small in the box [start, end] [s]; others are valid too."""
    half = (end - start) / 2
    with ball_arithmetic(2):
        nearest = [(balls_of(look.signal.kernel), _nearest(look, start + half)) for look in looks]
        radii = [half * ratio for ratio in _RATIOS]
        bounds = [
            sum((kernel.on_disc(r, arb(radius)) for kernel, r in nearest), arb(0)) * (arb(half) / arb(radius)) ** terms
            for radius in radii
        ]
        sizes = [float(bound.upper()) if bound.is_finite() else math.inf for bound in bounds]
        return radii[sizes.index(min(sizes))]


def _nearest(look: Look, middle: float) -> arb:
    """Return about how far the nearest centre is [s]; zero for kernels that repeat, as some crest is always near."""
    if balls_of(look.signal.kernel).has_periodic_part:
        return arb(0)
    return arb(float(np.min(np.abs(middle + float(look.shift) - look.signal.centres))))


def _midpoint(box: Box) -> tuple[arb, arb]:
    return (arb(box.start) + arb(box.end)) / 2, (arb(box.end) - arb(box.start)) / 2


def _side(box: Box, shift: arb) -> int:
    """Return the sign that t + shift certainly has for all t in the box: −1, 1, or 0 where it may have both."""
    if arb(box.start) + shift >= 0:
        return 1
    return -1 if arb(box.end) + shift <= 0 else 0
