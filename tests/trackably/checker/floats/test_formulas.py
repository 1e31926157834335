"""Formulas of many Taylor models at once, in float64, hold every value; planted faults let values escape."""

import random

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.checker.arithmetic import test_models as single
from trackably.checker import models
from trackably.checker.floats.intervals import Floats, join
from trackably.checker.intervals import ZERO, UndefinedError, iv
from trackably.checker.models import Model, Models

TERMS, COUNT = single.TERMS, 12
MODELS = Models(TERMS)
FORMED = {
    "a product": (lambda a, b: a * b, lambda a, b: a * b),
    "a quotient": (MODELS.over, lambda a, b: a / b),
    "a reciprocal": (lambda _, b: MODELS.power(b, -1.0), lambda _, b: 1 / b),
    "a power": (lambda _, b: MODELS.power(b, 1.7), lambda _, b: b ** mp.mpf(1.7)),
    "an angle": (MODELS.angle, mp.atan2),
    "the other angle": (lambda a, b: MODELS.angle(b, a), lambda a, b: mp.atan2(b, a)),
    **{
        name: (lambda _, b, name=name: MODELS.function(name, b), lambda _, b, name=name: getattr(mp, name)(b))
        for name in ("sqrt", "exp", "log", "sin", "cos", "atan")
    },
}
each = pytest.mark.parametrize("name", FORMED)


def many(of: list[Model]) -> Model:
    """The same models as one of arrays."""

    def array(numbers: list) -> Floats:
        return join([Floats.of(number).at(None) for number in numbers])

    rows = [array([model.coefficients[k] for model in of]) for k in range(TERMS)]
    return Model(rows, array([model.missed for model in of]))


def ends(number: object, box: int) -> tuple[mp.mpf, mp.mpf]:
    found = Floats.of(number)
    return tuple(mp.mpf(float(np.broadcast_to(end, COUNT)[box])) for end in (found.low, found.high))


def escapes(name: str, seed: int = 0, one_by_one: bool = False) -> int:
    """How many values lie outside of the models, formed all at once in float64, or each by itself in mpmath."""
    formed, true = FORMED[name]
    draw, count = random.Random(seed), 0
    with mp.workprec(2 * iv.prec), np.errstate(all="ignore"):
        for part, missed in ((0.0, 0.0), (1e-3, 0.0), (0.3, 1e-9), (0.5, 1e-2)):
            a = [single.drawn(draw, draw.uniform(-3, 3), 0.5, missed) for _ in range(COUNT)]
            b = [single.drawn(draw, draw.uniform(0.5, 3), part, missed) for _ in range(COUNT)]
            found = many(list(map(formed, a, b))) if one_by_one else formed(many(a), many(b))
            for box in range(COUNT):
                known = [ends(c, box) for c in found.coefficients]
                reach = ends(found.missed, box)[1] + sum(high - low for low, high in known)
                for x in (-1.0, draw.uniform(-1, 1), 1.0):
                    at = sum(low * mp.mpf(x) ** k for k, (low, _) in enumerate(known))
                    value = true(single.value(a[box], x, draw), single.value(b[box], x, draw))
                    count += not abs(value - at) <= reach
    return count


@each
@pytest.mark.parametrize("one_by_one", [False, True])
def test_they_hold_every_value(name, one_by_one):
    assert sum(escapes(name, seed, one_by_one) for seed in range(2)) == 0


@each
def test_they_are_as_narrow_as_single_ones(name):
    draw = random.Random(0)
    a = [single.drawn(draw, draw.uniform(1, 3), 0.2, 1e-9) for _ in range(COUNT)]
    b = [single.drawn(draw, draw.uniform(1, 3), 0.2, 1e-9) for _ in range(COUNT)]
    formed = FORMED[name][0]
    found = formed(many(a), many(b))
    for box in range(COUNT):
        assert ends(found.missed, box)[1] <= 1.5 * float(formed(a[box], b[box]).missed.b) + 1e-12


def test_where_one_may_have_no_value_is_said():
    with pytest.raises(UndefinedError) as caught:
        MODELS.over(MODELS.number(ZERO + 1), Model([Floats.exact(np.array([1.0, 0.0, np.nan]))] * TERMS, ZERO))
    assert not np.any(caught.value.where[1:])
    for y, x in (([1e-4, 1e-2], [-1.0, -1.0]), ([0.0, 1.0], [0.0, 0.0])):
        other = [Floats.exact(np.array([1e-3, 0.0])), *[ZERO] * (TERMS - 2)]
        vector = [Model([Floats.exact(np.array(of)), *other], ZERO) for of in (y, x)]
        with pytest.raises(UndefinedError) as caught:
            MODELS.angle(*vector)
        assert caught.value.where.tolist() == [False, True]


FAULTS = {
    "an angle that forgets its direction": (
        "an angle",
        lambda patch: patch.setattr(Floats, "direction", classmethod(lambda cls, y, _: cls.of(y) * 0.0)),
    ),
    "a quotient without its rest": (
        "a quotient",
        lambda patch: patch.setattr(models, "_within", lambda found, rest, _: found),
    ),
    "a wrong logarithm": ("a power", lambda patch: patch.setattr(Floats, "log", lambda x: x - 1)),
    "a wrong arc tangent": ("atan", lambda patch: patch.setattr(Floats, "atan", lambda x: x)),
    "a wrong square root": ("sqrt", lambda patch: patch.setattr(Floats, "sqrt", lambda x: x)),
    "a product that misses nothing": (
        "a product",
        lambda patch: patch.setattr(Model, "size", property(lambda _: ZERO)),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_faults_let_values_escape(fault, monkeypatch):
    name, plant = FAULTS[fault]
    plant(monkeypatch)
    try:
        assert any(escapes(name, seed) for seed in range(4))
    except UndefinedError:
        pytest.fail("the fault is not reached")
