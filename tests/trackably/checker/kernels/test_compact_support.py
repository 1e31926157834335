"""What the checker says of kernels with kinks at 0 and at θ₂: values, boxes that end there, and nothing beyond."""

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.checker.kernels.instances import KINKED, checked, kinks
from tests.trackably.gp.instances import formula, over
from trackably.checker.intervals import SIGN, ZERO
from trackably.checker.intervals import exactly as interval
from trackably.gp.kernels.base import Sum
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3

TERMS = 12


@over(KINKED)
def test_values_at_the_kinks(kernel):
    own, size = checked(kernel), float(kernel(0.0))
    with mp.workdps(50):
        for kink in kinks(kernel):
            for r in (kink, np.nextafter(kink, -9), np.nextafter(kink, 9)):
                for uncertain in (interval(r), interval(r) + SIGN * 2.0**-140, interval(r) / 3 * 3):
                    value, true = own.value(uncertain), formula(kernel)(mp.mpf(r))
                    low, high = (mp.mpf(end._mpi_[0]) for end in (value.a, value.b))
                    assert low - size * mp.mpf(10) ** -44 <= true <= high + size * mp.mpf(10) ** -44
                    assert high - low < 1e-38 * size


@over(KINKED)
def test_a_box_that_may_end_at_the_kink_has_a_model(kernel):
    half = interval(2.0**-6)
    for r in (half + SIGN * 2.0**-140, SIGN * 2.0**-140 - half):
        model = checked(kernel).model(r, half, 3 * half, TERMS)
        assert model.missed.b < 0.1 * float(kernel(0.0))


@pytest.mark.parametrize("family", [PiecewisePolynomial2, PiecewisePolynomial3])
def test_nothing_is_left_beyond_the_support(family):
    own, length = checked(family(1.0, 0.7)), interval(0.7)
    for distance in (length, length + 2.0**-150, 2 * length, interval(1e60)):
        assert own.beyond(distance) == (ZERO, ZERO)
    assert 0 < own.beyond(length + SIGN * 2.0**-100).size.b < 1e-100
    assert own.beyond(length * (1 - 2.0**-20)).size > 0


def test_a_box_with_both_kinks_and_a_middle_beyond_them_has_no_model():
    own = checked(Sum(PiecewisePolynomial2(1.0, 0.5), Matern52(1.0, 0.5)))
    for middle, finite in ((0.6, False), (0.51, False), (0.49, True), (0.1, True)):
        model = own.model(interval(middle), interval(1.0), interval(2.0), TERMS)
        assert bool(model.missed.b < 1e300) == finite
