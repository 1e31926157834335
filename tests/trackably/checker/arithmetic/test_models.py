"""Taylor models contain quotients and roots of all functions that their operands contain, and hardly anything else."""

import random

import pytest
from mpmath import mp

from trackably.checker.intervals import UndefinedError, exactly, iv
from trackably.checker.models import Model, Models

TERMS = 12
MODELS = Models(TERMS)
FORMED = {
    "a quotient": (MODELS.over, lambda a, b: a / b),
    "a reciprocal": (lambda _, b: MODELS.power(b, -1.0), lambda _, b: 1 / b),
    "a root": (lambda _, b: MODELS.function("sqrt", b), lambda _, b: mp.sqrt(b)),
}
each = pytest.mark.parametrize(("formed", "true"), FORMED.values(), ids=FORMED)


def drawn(draw: random.Random, first: float, part: float, missed: float) -> Model:
    """A model whose other coefficients have a `part` of the first one's size in all, and widths."""
    others = [draw.uniform(-1, 1) for _ in range(TERMS - 1)]
    scale = part * abs(first) / sum(map(abs, others))
    width = iv.mpf([0, 1e-15 * abs(first)])
    return Model([exactly(first), *(exactly(scale * c) + width for c in others)], exactly(missed))


def value(model: Model, x: float, draw: random.Random):
    """One function of the model at x: coefficients anywhere in their intervals, and as far off as it may be."""
    chosen = [_between(c, draw.choice([0.0, 0.3, 1.0])) for c in model.coefficients]
    off = draw.choice([-1.0, 0.5, 1.0]) * mp.mpf(model.missed.b._mpi_[1])
    return sum(c * mp.mpf(x) ** k for k, c in enumerate(chosen)) + off


def _between(interval, part: float):
    low, high = mp.mpf(interval.a._mpi_[0]), mp.mpf(interval.b._mpi_[1])
    return low + part * (high - low)


@each
def test_they_miss_little(formed, true):
    """What k terms of a series leave is of order k in the size of the other coefficients."""
    missed = []
    for part in (0.02, 0.04):
        a, b = ([exactly(sign**k * part**k / (k + 1)) for k in range(TERMS)] for sign in (-1, 1))
        missed.append(float(formed(Model(a, exactly(0)), Model(b, exactly(0))).missed.b))
    assert missed[1] < 1e-12
    assert missed[0] < missed[1] / 2 ** (TERMS - 1)


@each
@pytest.mark.parametrize("part", [1.0, 1.5])
def test_they_are_refused_where_an_operand_may_be_zero(formed, true, part):
    with pytest.raises(UndefinedError):
        formed(MODELS.number(exactly(1)), Model([exactly(1), exactly(part), *[exactly(0)] * (TERMS - 2)], exactly(0)))
