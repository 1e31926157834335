"""The checker's own enclosures of kernels with kinks at 0 and at θ₂, against 50 digits; and with planted faults."""

from collections import Counter
from typing import Any

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.checker.kernels.boxes import DIGITS, KINKED, TERMS, Differences, boxes, checked, exactly, kinks
from tests.trackably.gp.instances import over
from trackably.checker.intervals import SIGN, ZERO, Real, total
from trackably.checker.intervals import exactly as interval
from trackably.checker.kernels import PiecewisePolynomial
from trackably.gp.kernels.base import Kernel, Sum
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3

PAIR = (PiecewisePolynomial2(1.0, 0.7), PiecewisePolynomial3(1.0, 0.7))


def contains(found: Real, number) -> bool:
    slack = mp.mpf(10) ** -44
    return mp.mpf(found.a._mpi_[0]) - slack <= number <= mp.mpf(found.b._mpi_[1]) + slack


def escaped(kernel: Kernel, seed: int = 0, most: float = np.inf) -> Counter[str]:
    """Count the points at which κ lies outside of its model, and boxes with some finite model.

    Stop where more than `most` points do.
    """
    rng, counted, own = np.random.default_rng(seed), Counter[str](), checked(kernel)
    for box in boxes(kernel, rng):
        half = interval(box.half)
        model = own.model(interval(box.middle), half, half * float(rng.choice([1.3, 2.0, 6.0, 30.0])), TERMS)
        if counted["escaped"] > most:
            break
        counted["boxes"] += 1
        counted["finite"] += bool(model.missed.b < 1e300)
        with mp.workdps(DIGITS + 10):
            for x in box.points(rng, kinks(kernel)):
                value = total(c * interval(x) ** k for k, c in enumerate(model.coefficients)) + SIGN * model.missed
                counted["escaped"] += not contains(value, exactly(kernel, box, x))
    return counted


@over(KINKED)
def test_models_hold_the_kernel(kernel):
    counted = escaped(kernel)
    assert counted["escaped"] == 0
    assert counted["boxes"] >= 30
    assert counted["finite"] >= 0.8 * counted["boxes"]


@over(KINKED)
def test_values_at_the_kinks(kernel):
    own = checked(kernel)
    with mp.workdps(DIGITS):
        for kink in kinks(kernel):
            for r in (kink, np.nextafter(kink, -9), np.nextafter(kink, 9)):
                for uncertain in (interval(r), interval(r) + SIGN * 2.0**-140, interval(r) / 3 * 3):
                    value = own.value(uncertain)
                    assert contains(value, exactly(kernel, Differences(r, 1.0), 0.0))
                    assert value.b - value.a < 1e-38


@over(KINKED)
def test_a_box_that_may_end_at_the_kink_has_a_model(kernel):
    half = interval(2.0**-6)
    for r in (half + SIGN * 2.0**-140, SIGN * 2.0**-140 - half):
        model = checked(kernel).model(r, half, 3 * half, TERMS)
        assert model.missed.b < 0.1


@pytest.mark.parametrize("kernel", PAIR, ids=str)
def test_nothing_is_left_beyond_the_support(kernel):
    own, length = checked(kernel), interval(kernel.lengthscale)
    for distance in (length, length + 2.0**-150, 2 * length, interval(1e60)):
        assert own.beyond(distance) == (ZERO, ZERO)
    assert 0 < own.beyond(length + SIGN * 2.0**-100).size.b < 1e-100
    assert own.beyond(length * (1 - 2.0**-20)).size > 0


@pytest.mark.parametrize("kernel", PAIR, ids=str)
def test_bounds_beyond_a_distance_and_sizes(kernel):
    own, r = checked(kernel), np.linspace(0, 1.2, 20001) * kernel.lengthscale
    value, slope = np.abs(kernel.jet(r, 1))
    for distance in (0.0, 0.1, 0.2399, 0.24, 0.2759, 0.28, 0.6, 0.99):
        later = r >= distance * kernel.lengthscale
        size, rate = own.beyond(interval(distance * kernel.lengthscale))
        assert np.max(value[later]) <= float(size.b) * (1 + 1e-14)
        assert np.max(slope[later]) <= float(rate.b) * (1 + 1e-14)
    sizes = own.sizes(interval(1e60))
    for bound, found in zip(sizes, (value, slope, r * slope, r * value), strict=False):
        assert np.max(found) <= float(bound.b) <= 3 * np.max(found)


def test_a_box_with_both_kinks_and_a_middle_beyond_them_has_no_model():
    own = checked(Sum(PiecewisePolynomial2(1.0, 0.5), Matern52(1.0, 0.5)))
    for middle, finite in ((0.6, False), (0.51, False), (0.49, True), (0.1, True)):
        model = own.model(interval(middle), interval(1.0), interval(2.0), TERMS)
        assert bool(model.missed.b < 1e300) == finite


_jump = PiecewisePolynomial.jump
FAULTS: dict[str, dict[str, Any]] = {
    "no jump": {"jump": lambda *_: ZERO},
    "half a jump": {"jump": lambda *arguments: _jump(*arguments) / 2},
    "one branch for ever": {"_is_over": lambda *_: False, "jump": lambda *_: ZERO},
    "zero too early": {"_is_over": lambda kernel, r: bool(abs(r) > kernel.length * 0.999)},
    "a jump on one side": {"jump": lambda kernel, r, h: ZERO if kernel._is_over(r) else _jump(kernel, r, h)},
    "smooth at zero": {"has_kink": False},
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("kernel", PAIR, ids=str)
def test_planted_faults_are_seen(kernel, fault, monkeypatch):
    for name, wrong in FAULTS[fault].items():
        monkeypatch.setattr(PiecewisePolynomial, name, wrong)
    assert escaped(kernel, most=0)["escaped"] > 0
