"""Taylor models in float64 hold the signal, in boxes of all sizes, at kinks too; planted faults let it escape."""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.gp.instances import KERNELS, formula, over, time_scale
from trackably.checker import kernels
from trackably.checker.floats import signals
from trackably.checker.floats.intervals import Floats
from trackably.checker.floats.signals import Boxes, ManyCentres
from trackably.checker.form import a_kernel
from trackably.checker.intervals import ZERO
from trackably.checker.kernels import Kernel as CheckedKernel
from trackably.checker.kernels import Matern
from trackably.checker.kernels import Matern52 as CheckedMatern52
from trackably.checker.kernels import PiecewisePolynomial2 as CheckedCompact
from trackably.checker.kernels import SquaredExponential as CheckedSquaredExponential
from trackably.checker.models import Model
from trackably.checker.subject import Signal
from trackably.codec import encode
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
    checked = a_kernel(encode(kernel), "kernel")
    shift = int(rng.integers(0, 3)) * Fraction(0.1 * scale)
    return ManyCentres.of(Signal(checked, 0.0, tuple(centres.tolist()), tuple(weights.tolist())), shift)


def boxes_around(of: ManyCentres, scale: float, rng: np.random.Generator) -> Boxes:
    """Boxes that hold a kink, begin or end at one up to rounding, or are anywhere."""
    ends_of_support = rng.choice([-1.0, 0.0, 1.0], 10) * scale
    at = rng.choice(of.centres, 10) - float(of.shift) + ends_of_support * rng.choice([1.0, 0.7], 10)
    halves = scale * 10 ** rng.uniform(-4, -0.5, 10)
    starts = at - halves * rng.choice([0.0, 1.0, 0.3, 1e-9], 10)
    ends = at + halves * np.where(starts < at, rng.choice([0.0, 1.0, 0.7], 10), 1.0)
    return Boxes(starts, ends, (ends - starts) / 2 * rng.choice([1.3, 2.0, 6.0, 64.0], 10))


def wide_boxes_beside(of: ManyCentres, scale: float, rng: np.random.Generator) -> Boxes:
    """Boxes far before and after all centres, as wide as a hundred or ten thousand time scales."""
    wide = scale * np.tile([1e2, 1e4], 2)
    gaps = wide * rng.uniform(1, 4, 4)
    starts = np.where([True, True, False, False], of.centres[0] - gaps - wide, of.centres[-1] + gaps) - float(of.shift)
    return Boxes(starts, starts + wide, wide / 2 + gaps * rng.choice([0.3, 0.9], 4))


def escapes(kernel: Kernel, seed: int) -> Iterator[bool]:
    """Yield whether the signal lies outside of its enclosure, at some times of some boxes."""
    rng, kappa = np.random.default_rng(seed), formula(kernel)
    of = drawn(kernel, rng)
    boxes = boxes_around(of, time_scale(kernel), rng)
    with np.errstate(all="ignore"):
        models = of.enclose(boxes, TERMS)
    yield from _outside(of, boxes, models, kappa, rng)


def _outside(of: ManyCentres, boxes: Boxes, models: Model, kappa, rng) -> Iterator[bool]:
    with mp.workdps(50):
        shift = mp.mpf(of.shift.numerator) / of.shift.denominator
        for b, (start, end) in enumerate(zip(boxes.starts.tolist(), boxes.ends.tolist(), strict=True)):
            for t in (start, end, rng.uniform(start, end)):
                true = sum(
                    c * kappa(t + shift - t_i)
                    for t_i, c in zip(map(mp.mpf, of.centres.tolist()), of.weights.tolist(), strict=True)
                )
                x = (2 * mp.mpf(t) - start - end) / (mp.mpf(end) - start)
                low, high = _ends([c.at(b) for c in models.coefficients], float(models.missed.high[b]), x)
                yield bool(true < low or true > high)


def _ends(coefficients: list[Floats], missed: float, x: mp.mpf) -> tuple[mp.mpf, mp.mpf]:
    parts = [sorted((mp.mpf(float(c.low)) * x**k, mp.mpf(float(c.high)) * x**k)) for k, c in enumerate(coefficients)]
    return sum(low for low, _ in parts) - missed, sum(high for _, high in parts) + missed


@over(KERNELS)
@pytest.mark.parametrize("seed", range(2))
def test_models_hold_the_signal(kernel, seed):
    assert not any(escapes(kernel, seed))


@over(KERNELS)
def test_models_in_wide_boxes_far_from_all_centres_hold_the_signal_and_say_that_it_rests(kernel):
    rng, kappa, scale = np.random.default_rng(1), formula(kernel), time_scale(kernel)
    of = drawn(kernel, rng)
    boxes = wide_boxes_beside(of, scale, rng)
    with np.errstate(all="ignore"):
        models = of.enclose(boxes, TERMS)
    assert not any(_outside(of, boxes, models, kappa, rng))
    if of.reach[0] < 50 * scale or isinstance(of.kernel, Matern):
        assert np.all(models.missed.high <= 1e-6)


@over(KERNELS)
def test_values_hold_the_signal_to_six_digits(kernel):
    rng, kappa = np.random.default_rng(0), formula(kernel)
    of = drawn(kernel, rng)
    with mp.workdps(50):
        for time in rng.choice(of.centres, 4).tolist():
            found, shift = of.at(time), mp.mpf(of.shift.numerator) / of.shift.denominator
            true = sum(c * kappa(mp.mpf(time) + shift - t) for t, c in zip(of.centres, of.weights, strict=True))
            assert found.low <= true <= found.high
            assert found.high - found.low < 1e-9 * np.sum(np.abs(of.weights)) * kappa(mp.mpf(0))


@over(KERNELS)
def test_models_are_narrow_where_boxes_are(kernel):
    """A model that knows nothing holds everything: most small boxes have finite models, as narrow as rounding lets."""
    rng = np.random.default_rng(0)
    of = drawn(kernel, rng)
    starts = of.centres[:8] - float(of.shift) + time_scale(kernel) * rng.uniform(0.05, 0.1, 8)
    halves = np.full(8, 0.001 * time_scale(kernel))
    with np.errstate(all="ignore"):
        models = of.enclose(Boxes(starts, starts + 2 * halves, 6 * halves), TERMS)
    assert np.mean(models.missed.high < 1e-3 * np.max(np.abs(of.weights))) > 0.8
    for c in models.coefficients:
        assert np.all(c.high - c.low < 1e-9 * np.sum(np.abs(of.weights)) * 1e3)


def narrower(monkeypatch, name: str, of: type = ManyCentres, factor: float = 0.0) -> None:
    right = getattr(of, name)
    monkeypatch.setattr(of, name, lambda *arguments: right(*arguments) * factor)


FAULTS = {
    "a remainder that is too small": (
        SquaredExponential(0.7, 0.22),
        lambda patch: patch.setattr(kernels, "geometric_rest", lambda ratio, n: ratio ** (2 * n)),
    ),
    "a wrong bound on discs": (
        SquaredExponential(0.7, 0.22),
        lambda patch: narrower(patch, "largest_on_disc", CheckedSquaredExponential, 1e-6),
    ),
    "a wrong bound of many centres on discs": (
        Matern52(1.0, 1.0),
        lambda patch: narrower(patch, "largest_around", CheckedMatern52, 1e-6),
    ),
    "moments that do not move": (Matern52(1.0, 1.0), lambda patch: patch.setattr(signals, "_move", lambda m, _: m)),
    "moments without the last one": (
        Matern52(1.0, 1.0),
        lambda patch: patch.setattr(signals.CentresBefore, "moments", _without_the_last),
    ),
    "a centre inside a box taken for one before it": (
        Matern32(1.0, 1.0),
        lambda patch: patch.setattr(ManyCentres, "_inside", _one_too_late),
    ),
    "a wrong derivative": (
        SquaredExponential(1.0, 1.0),
        lambda patch: patch.setattr(CheckedSquaredExponential, "taylor", _with_a_wrong_slope),
    ),
    "kinks overlooked": (
        Matern32(1.0, 1.0),
        lambda patch: patch.setattr(CheckedKernel, "_beyond_kink", lambda _, r, *others: r * 0.0),
    ),
    "ends of support overlooked": (
        PiecewisePolynomial2(1.0, 1.0),
        lambda patch: patch.setattr(CheckedCompact, "jump", lambda *_: ZERO),
    ),
    "far centres overlooked": (
        SquaredExponential(1.0, 1.0),
        lambda patch: patch.setattr(signals.ManyCentres, "reach", (0.5, Floats.exact(0.0))),
    ),
}
_right_taylor = CheckedSquaredExponential.taylor


_right_moments = signals.CentresBefore.moments
_right_inside = ManyCentres._inside


def _without_the_last(before, at):
    *others, last = _right_moments(before, at)
    return [*others, last * 0.0]


def _one_too_late(of, boxes):
    first, stop = _right_inside(of, boxes)
    return np.minimum(first + 1, stop - 1), stop


def _with_a_wrong_slope(kernel, r, h, n):
    found = _right_taylor(kernel, r, h, n)
    return [*found[:1], *(c * (1 + 1e-9) for c in found[1:2]), *found[2:]]


@pytest.mark.parametrize(("kernel", "plant"), FAULTS.values(), ids=FAULTS)
def test_planted_faults_let_the_signal_escape(kernel, plant, monkeypatch):
    plant(monkeypatch)
    assert any(any(escapes(kernel, seed)) for seed in range(6))
