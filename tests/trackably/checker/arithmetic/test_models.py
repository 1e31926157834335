"""Taylor models, single in mpmath and many in float64, hold every value of a formula, and little else.

Planted faults let values escape.
"""

import random
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest
from mpmath import mp

from trackably.checker import models
from trackably.checker.floats.intervals import Floats, stack
from trackably.checker.intervals import ZERO, UndefinedError, between, exactly, iv
from trackably.checker.models import Model

TERMS, COUNT = 12, 8
SERIES = {
    "a quotient": (lambda a, b: a / b, lambda a, b: a / b),
    "a reciprocal": (lambda _, b: b.power(-1.0), lambda _, b: 1 / b),
    "sqrt": (lambda _, b: b.function("sqrt"), lambda _, b: mp.sqrt(b)),
}
FORMED = {
    **SERIES,
    "a product": (lambda a, b: a * b, lambda a, b: a * b),
    "a power": (lambda _, b: b.power(1.7), lambda _, b: b ** mp.mpf(1.7)),
    "an angle": (Model.angle, mp.atan2),
    "the other angle": (lambda a, b: b.angle(a), lambda a, b: mp.atan2(b, a)),
    **{
        name: (lambda _, b, name=name: b.function(name), lambda _, b, name=name: getattr(mp, name)(b))
        for name in ("exp", "log", "sin", "cos", "atan")
    },
}


def drawn(draw: random.Random, first: float, part: float, missed: float) -> Model:
    """A model whose other coefficients have a `part` of the first one's size in all, and widths."""
    others = [draw.uniform(-1, 1) for _ in range(TERMS - 1)]
    scale = part * abs(first) / sum(map(abs, others))
    width = iv.mpf([0, 1e-15 * abs(first)])
    return Model([exactly(first), *(exactly(scale * c) + width for c in others)], exactly(missed))


def value(model: Model, x: float, draw: random.Random) -> Any:
    """One function of the model at x: coefficients anywhere in their intervals, and as far off as it may be."""
    off = draw.choice([-1.0, 0.5, 1.0]) * at_part(model.missed, 1.0)
    return (
        sum(at_part(c, draw.choice([0.0, 0.3, 1.0])) * mp.mpf(x) ** k for k, c in enumerate(model.coefficients)) + off
    )


def at_part(interval: Any, part: float) -> Any:
    low, high = mp.mpf(interval.a._mpi_[0]), mp.mpf(interval.b._mpi_[1])
    return low + part * (high - low)


Formed = Callable[[Model, Model], Model]


def single(formed: Formed, a: list[Model], b: list[Model]) -> list[Model]:
    return [formed(*pair) for pair in zip(a, b, strict=True)]


def many(formed: Formed, a: list[Model], b: list[Model]) -> list[Model]:
    with np.errstate(all="ignore"):
        found = formed(together(a), together(b))
    return [Model([part(c, box) for c in found.coefficients], part(found.missed, box)) for box in range(len(a))]


def together(of: list[Model]) -> Model:
    """The same models as one of arrays."""
    rows = [stack(row, ()) for row in zip(*([*m.coefficients, m.missed] for m in of), strict=True)]
    return Model(rows[:TERMS], rows[TERMS])


def part(number: Any, box: int) -> Any:
    found = Floats.of(number)
    return between(*(float(np.broadcast_to(end, COUNT)[box]) for end in (found.low, found.high)))


def escapes(name: str, evaluated: Callable[..., list[Model]], seed: int = 0) -> int:
    """How many values lie outside of the models."""
    formed, true = FORMED[name]
    draw, count = random.Random(seed), 0
    with mp.workprec(2 * iv.prec):
        for part_of_first, missed in ((0.0, 0.0), (1e-3, 0.0), (0.3, 1e-9), (0.5, 1e-2)):
            a = [drawn(draw, draw.uniform(-3, 3), 0.5, missed) for _ in range(COUNT)]
            b = [drawn(draw, draw.uniform(0.5, 3), part_of_first, missed) for _ in range(COUNT)]
            for one, other, found in zip(a, b, evaluated(formed, a, b), strict=True):
                width = sum(at_part(c, 1.0) - at_part(c, 0.0) for c in found.coefficients)
                for x in (-1.0, draw.uniform(-1, 1), 1.0):
                    at = sum(at_part(c, 0.5) * mp.mpf(x) ** k for k, c in enumerate(found.coefficients))
                    off = abs(true(value(one, x, draw), value(other, x, draw)) - at)
                    count += not off <= at_part(found.missed, 1.0) + width
    return count


@pytest.mark.parametrize("evaluated", [single, many])
@pytest.mark.parametrize("name", FORMED)
def test_they_hold_every_value(name, evaluated):
    assert escapes(name, evaluated) == 0


@pytest.mark.parametrize("formed", [formed for formed, _ in SERIES.values()], ids=SERIES)
def test_series_miss_what_is_of_the_order_of_the_next_term(formed):
    missed = []
    for size in (0.02, 0.04):
        a, b = ([exactly(sign**k * size**k / (k + 1)) for k in range(TERMS)] for sign in (-1, 1))
        missed.append(float(formed(Model(a, exactly(0)), Model(b, exactly(0))).missed.b))
    assert missed[1] < 1e-12
    assert missed[0] < missed[1] / 2 ** (TERMS - 1)


def test_where_one_may_have_no_value_is_said():
    for (formed, _), slope in product(SERIES.values(), (1.0, 1.5)):
        with pytest.raises(UndefinedError):
            formed(Model.constant(exactly(1), TERMS), Model([exactly(1), exactly(slope), *[ZERO] * (TERMS - 2)], ZERO))
    with pytest.raises(UndefinedError) as caught:
        _ = Model.constant(ZERO + 1, TERMS) / Model([Floats.exact(np.array([1.0, 0.0, np.nan]))] * TERMS, ZERO)
    assert not np.any(caught.value.where[1:])
    for y, x in (([1e-4, 1e-2], [-1.0, -1.0]), ([0.0, 1.0], [0.0, 0.0])):
        other = [Floats.exact(np.array([1e-3, 0.0])), *[ZERO] * (TERMS - 2)]
        vector = [Model([Floats.exact(np.array(of)), *other], ZERO) for of in (y, x)]
        with pytest.raises(UndefinedError) as caught:
            Model.angle(*vector)
        assert caught.value.where.tolist() == [False, True]


FAULTS = {
    "an angle that forgets its direction": (
        "an angle", Floats, "direction", classmethod(lambda cls, y, _: cls.of(y) * 0.0)
    ),
    "a quotient without its rest": ("a quotient", models, "_within", lambda found, rest, _: found),
    "a wrong logarithm": ("a power", Floats, "log", lambda x: x - 1),
    "a product that misses nothing": ("a product", Model, "size", property(lambda _: ZERO)),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_let_values_escape(fault, monkeypatch):
    name, *plant = FAULTS[fault]
    monkeypatch.setattr(*plant)
    try:
        assert any(escapes(name, many, seed) for seed in range(6))
    except UndefinedError:
        pytest.fail("the fault is not reached")
