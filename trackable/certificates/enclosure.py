"""Enclose a quantity over a box of time: a Taylor polynomial about the midpoint, and a bound of its error."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

from flint import arb, arb_poly, arb_series

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.models import Enclosure, Models
from trackable.certificates.exact import ExactFunctional, ExactQuantity, ShiftedSignal
from trackable.certificates.kernels.base import Expansion
from trackable.certificates.kernels.table import balls_of
from trackable.systems.formulas.evaluation import evaluate
from trackable.systems.formulas.expression import Variable

_REMEMBERED = 4096  # enclosures of shifted signals: several quantities use the same boxes
ENLARGED = 4
"""Remainders of formulas are enlarged by this factor: a checker with slightly cruder bounds then still agrees."""


@dataclass(frozen=True)
class Box:
    """All real times in [start, end] [s], start < end; `radius` [s] of the discs in Cauchy's estimate."""

    start: float
    end: float
    radius: float


def remainder(functional: ExactFunctional, box: Box, terms: int) -> arb:
    """Bound the error of a Taylor polynomial with `terms` terms in the box; infinite if the disc is too small."""
    with ball_arithmetic(2):
        return sum((abs(weight) * missed(shifted, box, terms) for weight, shifted in functional.terms), arb(0))


@lru_cache(_REMEMBERED)
def missed(shifted: ShiftedSignal, box: Box, terms: int) -> arb:
    """Return Σ_i |c_i| times the bound of the error of the Taylor polynomial of κ(t + s − t_i)."""
    kernel = balls_of(shifted.signal.kernel)
    with ball_arithmetic(2):
        middle, half = _midpoint(box)
        expansion = Expansion(half, arb(box.radius), terms)
        return sum(
            (abs(c) * kernel.missed(middle + shift, expansion, _side(box, shift)) for shift, c in shifted.summands),
            arb(0),
        )


def enclosure(quantity: ExactQuantity, box: Box, terms: int) -> Enclosure:
    """Return a polynomial with `terms` terms and its remainder. UndefinedError where q may not be defined."""
    return of_arguments(quantity, arguments_in(quantity, box, terms), terms)


def arguments_in(quantity: ExactQuantity, box: Box, terms: int) -> dict[str, Enclosure]:
    """Enclose the arguments of a quantity."""
    return {name: _enclosure(functional, box, terms) for name, functional in quantity.arguments.items()}


def of_arguments(quantity: ExactQuantity, arguments: Mapping[str, Enclosure], terms: int) -> Enclosure:
    """Enclose a quantity whose arguments are enclosed. UndefinedError where it may not be defined."""
    if isinstance(quantity.formula, Variable):
        return arguments[quantity.formula.name]
    with ball_arithmetic(terms):
        found = evaluate(quantity.formula, arguments, Models())
        return Enclosure(found.coefficients, ENLARGED * found.remainder)


def _enclosure(functional: ExactFunctional, box: Box, terms: int) -> Enclosure:
    with ball_arithmetic(terms):
        found = sum((polynomial(shifted, box, terms) * weight for weight, shifted in functional.terms), arb_poly())
        return Enclosure(found + functional.offset, remainder(functional, box, terms))


@lru_cache(_REMEMBERED)
def polynomial(shifted: ShiftedSignal, box: Box, terms: int) -> arb_poly:
    """Return the first `terms` terms of the Taylor series of Σ_i c_i κ(middle + h x + s − t_i) in x."""
    kernel = balls_of(shifted.signal.kernel)
    with ball_arithmetic(terms):
        middle, half = _midpoint(box)
        expansion, found = Expansion(half, arb(box.radius), terms), arb_series([0], prec=terms)
        for shift, c in shifted.summands:
            found += kernel.polynomial(middle + shift, expansion, _side(box, shift)) * c
        return arb_poly(found.coeffs())


def _midpoint(box: Box) -> tuple[arb, arb]:
    return (arb(box.start) + arb(box.end)) / 2, (arb(box.end) - arb(box.start)) / 2


def _side(box: Box, shift: arb) -> int:
    """Return the sign of t + shift if it is certain for all t in the box (−1 or 1), otherwise 0."""
    if arb(box.start) + shift >= 0:
        return 1
    return -1 if arb(box.end) + shift <= 0 else 0
