"""Kernels stated as one exponential, and products of them, against the product of their series."""

import pytest
from flint import arb, arb_series

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.kernels.combinations import ProductBalls, SumBalls
from trackable.certificates.kernels.elementary import ElementaryBalls
from trackable.certificates.kernels.matern import Matern52Balls
from trackable.certificates.kernels.periodic import PeriodicBalls
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls

TERMS = 16
SMOOTH: tuple[ElementaryBalls, ...] = (SquaredExponentialBalls(1.3, 2.0), PeriodicBalls(0.7, 0.9, 3.1))
ROUGH = Matern52Balls(1.1, 1.7)
POINTS = (0.0, 0.3, 2.9, 40.0)


@pytest.mark.parametrize("right", [*SMOOTH, ROUGH, ProductBalls(*SMOOTH)])
@pytest.mark.parametrize("left", [*SMOOTH, ROUGH])
def test_a_product_is_the_product_of_its_series(left, right):
    with ball_arithmetic(TERMS):
        for at in POINTS:
            r = arb_series([at, 0.25], prec=TERMS)
            found, expected = ProductBalls(left, right).taylor(r), left.taylor(r) * right.taylor(r)
            for a, b in zip(found.coeffs(), expected.coeffs(), strict=True):
                assert a.overlaps(b)
                assert a.rad() <= 8 * b.rad() + arb(2) ** -140


def test_only_products_of_exponentials_are_one():
    with ball_arithmetic(TERMS):
        r = arb_series([1.0, 0.25], prec=TERMS)
        assert ProductBalls(*SMOOTH).exponential(r)
        for kernel in (ROUGH, ProductBalls(SMOOTH[0], ROUGH), SumBalls(*SMOOTH)):
            assert kernel.exponential(r) is None


def test_constants_have_full_precision_wherever_they_are_first_used():
    kernel = PeriodicBalls(0.7, 0.9, 3.1)
    for constant in (kernel.omega, kernel.variance, kernel.squared_length):  # outside of ball arithmetic: 53 bits
        assert constant.rad() < 2.0**-150
