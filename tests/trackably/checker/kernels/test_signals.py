"""Taylor models hold the signal, many in float64 and single ones in mpmath, in boxes of all sizes, at kinks too.

Planted faults let it escape.
"""

from collections.abc import Callable, Iterator
from fractions import Fraction
from operator import le, lt
from typing import Any

import numpy as np
from mpmath import mp

from tests.trackably.checker.kernels.instances import KINKED, checked
from tests.trackably.gp.instances import KERNELS, formula, over, time_scale
from trackably.checker import kernels, subject
from trackably.checker.boxes import Box, enclose_signal
from trackably.checker.floats import signals
from trackably.checker.floats.intervals import Floats, stack
from trackably.checker.floats.signals import Boxes, ManyCentres
from trackably.checker.intervals import ZERO, ratio
from trackably.checker.kernels import Decay, Matern, Reach
from trackably.checker.models import Model
from trackably.checker.subject import Signal
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2
from trackably.gp.kernels.squared_exponential import SquaredExponential

TERMS, COUNT = 10, 24


def drawn(kernel: Kernel, rng: np.random.Generator) -> ManyCentres:
    """Centres near and far, some at one place, in no order."""
    scale = time_scale(kernel)
    centres = scale * 10 ** rng.uniform(-0.5, 2.5) * np.round(rng.uniform(-1, 1, COUNT), 2)
    weights = rng.normal(size=COUNT) * 10 ** rng.uniform(-2, 2, COUNT)
    return ManyCentres.of(Signal(checked(kernel), 0.0, tuple(centres.tolist()), tuple(weights.tolist())))


def shifts(scale: float, count: int, rng: np.random.Generator) -> list[Fraction]:
    first = int(rng.integers(0, 3))
    return [(first + b) % 3 * Fraction(0.1 * scale) for b in range(count)]


def boxes_around(of: ManyCentres, scale: float, rng: np.random.Generator) -> Boxes:
    """Boxes that hold a kink, begin or end at one up to rounding, or are anywhere."""
    moved = shifts(scale, 10, rng)
    ends_of_support = rng.choice([-1.0, 0.0, 1.0], 10) * scale
    at = rng.choice(of.centres, 10) - np.array(moved, dtype=float) + ends_of_support * rng.choice([1.0, 0.7], 10)
    halves = scale * 10 ** rng.uniform(-4, -0.5, 10)
    starts = at - halves * rng.choice([0.0, 1.0, 0.3, 1e-9], 10)
    ends = at + halves * np.where(starts < at, rng.choice([0.0, 1.0, 0.7], 10), 1.0)
    return Boxes(starts, ends, (ends - starts) / 2 * rng.choice([1.3, 2.0, 6.0, 64.0], 10), moved)


def wide_boxes_beside(of: ManyCentres, scale: float, rng: np.random.Generator) -> Boxes:
    """Boxes far before and after all centres, as wide as a hundred or ten thousand time scales."""
    wide = scale * np.tile([1e2, 1e4], 2)
    gaps, moved = wide * rng.uniform(1, 4, 4), shifts(scale, 4, rng)
    starts = np.where([True, True, False, False], of.centres[0] - gaps - wide, of.centres[-1] + gaps)
    starts -= np.array(moved, dtype=float)
    return Boxes(starts, starts + wide, wide / 2 + gaps * rng.choice([0.3, 0.9], 4), moved)


Enclosed = Callable[[ManyCentres, Boxes], Model]


def many(of: ManyCentres, boxes: Boxes) -> Model:
    with np.errstate(all="ignore"):
        return of.enclose(boxes, TERMS)


def single(of: ManyCentres, boxes: Boxes) -> Model:
    """In mpmath, one box after the other."""
    signal = Signal(of.kernel, 0.0, tuple(of.centres.tolist()), tuple(of.weights.tolist()))
    each = zip(boxes.starts.tolist(), boxes.ends.tolist(), boxes.radii.tolist(), map(ratio, boxes.shifts), strict=True)
    models = [enclose_signal(signal, shift, Box(*box), TERMS) for *box, shift in each]
    rows = zip(*([*m.coefficients, m.missed] for m in models), strict=True)
    *found, missed = (stack(row, ()) for row in rows)
    return Model(found, missed)


def escapes(kernel: Kernel, seed: int, enclosed: Enclosed) -> Iterator[bool]:
    """Yield whether the signal lies outside of its enclosure, at some times of some boxes."""
    rng = np.random.default_rng(seed)
    of = drawn(kernel, rng)
    boxes = boxes_around(of, time_scale(kernel), rng)
    yield from _outside(of, boxes, enclosed(of, boxes), formula(kernel), rng)


def _outside(of: ManyCentres, boxes: Boxes, models: Model, kappa, rng) -> Iterator[bool]:
    with mp.workdps(50):
        for b, (start, end) in enumerate(zip(boxes.starts.tolist(), boxes.ends.tolist(), strict=True)):
            for t in (start, end, rng.uniform(start, end)):
                true = _value(of, kappa, t, boxes.shifts[b])
                x = (2 * mp.mpf(t) - start - end) / (mp.mpf(end) - start)
                low, high = _ends([c.at(b) for c in models.coefficients], float(models.missed.high[b]), x)
                yield bool(true < low or true > high)


def _value(of: ManyCentres, kappa, t: float, shift: Fraction) -> Any:
    moved = mp.mpf(t) + mp.mpf(shift.numerator) / shift.denominator
    return sum(c * kappa(moved - t_i) for t_i, c in zip(of.centres.tolist(), of.weights.tolist(), strict=True))


def _ends(coefficients: list[Floats], missed: float, x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    parts = [sorted((mp.mpf(float(c.low)) * x**k, mp.mpf(float(c.high)) * x**k)) for k, c in enumerate(coefficients)]
    return sum(low for low, _ in parts) - missed, sum(high for _, high in parts) + missed


SMALL = ("se_short", "matern32_short", "rq_heavy", "periodic_pi", "product")
DRAWN = {
    **{name: (kernel, seed, many) for seed, (name, kernel) in enumerate(KERNELS.items())},
    **{f"{name}, in mpmath": (KERNELS[name], 0, single) for name in (*SMALL, *KINKED)},
}


@over(DRAWN, "kernel", "seed", "enclosed")
def test_models_hold_the_signal(kernel, seed, enclosed):
    assert not any(escapes(kernel, seed, enclosed))


@over(KERNELS)
def test_models_in_wide_boxes_far_from_all_centres_hold_the_signal_and_say_that_it_rests(kernel):
    rng, kappa, scale = np.random.default_rng(1), formula(kernel), time_scale(kernel)
    of = drawn(kernel, rng)
    boxes = wide_boxes_beside(of, scale, rng)
    models = many(of, boxes)
    assert not any(_outside(of, boxes, models, kappa, rng))
    if of.reach < 50 * scale or isinstance(of.kernel, Matern):
        assert np.all(models.missed.high <= 1e-6)


def test_the_side_of_a_time_on_which_a_centre_is_is_exact():
    rng = np.random.default_rng(0)
    of = drawn(ROUGH, rng)
    boxes = boxes_around(of, 1.0, rng)
    for times, side, is_passed in ((boxes.starts, "right", le), (boxes.ends, "left", lt)):
        at = map(sum, zip(map(Fraction, times.tolist()), boxes.shifts, strict=True))
        passed = [sum(is_passed(centre, t) for centre in of.centres.tolist()) for t in at]
        assert of.passed(times, boxes, side).tolist() == passed


@over(KERNELS)
def test_models_are_narrow_where_boxes_are(kernel):
    """A model that knows nothing holds everything: most small boxes have finite models, as narrow as rounding lets."""
    rng = np.random.default_rng(0)
    of = drawn(kernel, rng)
    starts = of.centres[:8] + time_scale(kernel) * rng.uniform(0.05, 0.1, 8)
    halves = np.full(8, 0.001 * time_scale(kernel))
    models = many(of, Boxes(starts, starts + 2 * halves, 6 * halves, [Fraction(0)] * 8))
    assert np.mean(models.missed.high < 1e-3 * np.max(np.abs(of.weights))) > 0.8
    for c in models.coefficients:
        assert np.all(c.high - c.low < 1e-9 * np.sum(np.abs(of.weights)) * 1e3)


def scaled(factor: float) -> Callable[[Any], Any]:
    return lambda right: lambda *arguments: right(*arguments) * factor


SHORT, ROUGH, SMOOTH, ENDS = (
    SquaredExponential(0.7, 0.22),
    Matern32(1.0, 1.0),
    Matern52(1.0, 1.0),
    PiecewisePolynomial2(1.0, 0.7),
)
FAULTS: dict[str, tuple[Enclosed, Kernel, Any, str, Callable[[Any], Any]]] = {
    "a wrong bound on discs": (many, SHORT, kernels.SquaredExponential, "largest_on_disc", scaled(1e-6)),
    "a wrong bound of many centres on discs": (many, SMOOTH, kernels.Matern52, "largest_around", scaled(1e-6)),
    "moments without the last one": (
        many, SMOOTH, signals.CentresBefore, "moments",
        lambda right: property(lambda of: [*right.func(of)[:-1], right.func(of)[-1] * 0.0]),
    ),
    "a centre inside a box taken for one before it": (
        many, ROUGH, ManyCentres, "_near",
        lambda right: lambda *of: (np.minimum(right(*of)[0] + 1, right(*of)[1] - 1), right(*of)[1]),
    ),
    "kinks overlooked": (many, ROUGH, kernels.Kernel, "_beyond_kink", lambda _: lambda _, r, *others: r * 0.0),
    "far centres overlooked": (many, SHORT, subject, "reach", lambda _: lambda *_: Reach(0.5, Decay(ZERO, ZERO))),
    "a reach that is too short": (
        single, SMOOTH, subject, "reach", lambda right: lambda *of: Reach(2.0, right(*of).decay)
    ),
    "half a jump": (many, ENDS, kernels.PiecewisePolynomial, "jump", scaled(0.5)),
    "a jump on one side": (
        single, ENDS, kernels.PiecewisePolynomial, "jump",
        lambda right: lambda kernel, r, h: ZERO if kernel._is_over(r) else right(kernel, r, h),
    ),
    "zero too early": (
        single, ENDS, kernels.PiecewisePolynomial, "_is_over", lambda _: lambda of, r: bool(abs(r) > of.length * 0.999)
    ),
    "smooth at zero": (single, ENDS, kernels.PiecewisePolynomial, "has_kink", lambda _: False),
}  # fmt: skip


@over(FAULTS, "enclosed", "kernel", "owner", "name", "wrong")
def test_planted_faults_let_the_signal_escape(enclosed, kernel, owner, name, wrong, monkeypatch):
    monkeypatch.setattr(ManyCentres, "of", staticmethod(ManyCentres.of.__wrapped__))  # nothing right is remembered
    monkeypatch.setattr(owner, name, wrong(getattr(owner, name)))
    assert any(any(escapes(kernel, seed, enclosed)) for seed in range(6))
