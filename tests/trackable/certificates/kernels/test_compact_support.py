"""Enclosures of kernels with kinks at 0 and at θ₂ hold 50 digits of mpmath; each planted fault lets some escape."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest
from flint import arb, arb_poly
from mpmath import mp

from tests.trackable.certificates.kernels.boxes import DIGITS, KINKED, TERMS, Differences, boxes, exactly, kinks
from tests.trackable.gp.instances import over
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.kernels.base import Expansion, KernelBalls
from trackable.certificates.kernels.piecewise_polynomial import PiecewisePolynomialBalls
from trackable.certificates.kernels.table import balls_of
from trackable.gp.kernels.base import Kernel, Sum
from trackable.gp.kernels.matern import Matern52
from trackable.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3

PAIR = (PiecewisePolynomial2(1.0, 0.7), PiecewisePolynomial3(1.0, 0.7))


@dataclass(frozen=True)
class Enclosed:
    """The enclosure of a kernel in a box: a polynomial in x, and what it misses at most."""

    polynomial: object
    missed: arb

    @classmethod
    def of(cls, kernel: KernelBalls, box: Differences, ratio: float) -> "Enclosed":
        middle, half = arb(box.middle), arb(box.half)
        expansion = Expansion(half, half * ratio, TERMS)
        return cls(
            arb_poly(kernel.polynomial(middle, expansion, box.side).coeffs()),
            kernel.missed(middle, expansion, box.side),
        )

    def off(self, x: float, number) -> arb:
        """Return how far the polynomial is from a number."""
        return abs(self.polynomial(arb(x)) - arb(mp.nstr(number, DIGITS)))


def escaped(kernel: Kernel, seed: int = 0, most: float = np.inf) -> Counter[str]:
    """Count the points at which κ lies outside of its enclosure, and boxes with some finite enclosure.

    Stop where more than `most` points do.
    """
    rng, counted = np.random.default_rng(seed), Counter[str]()
    for box in boxes(kernel, rng):
        if counted["escaped"] > most:
            break
        ratio = float(rng.choice([1.3, 2.0, 6.0, 30.0]))
        with mp.workdps(DIGITS + 10), ball_arithmetic(TERMS):
            found = Enclosed.of(balls_of(kernel), box, ratio)
            counted["boxes"] += 1
            counted["finite"] += found.missed.is_finite()
            for x in box.points(rng, kinks(kernel)):
                escapes = found.off(x, exactly(kernel, box, x)) > found.missed + arb(10) ** -44
                counted["escaped"] += bool(escapes)
    return counted


@over(KINKED)
@pytest.mark.parametrize("seed", range(2))
def test_enclosures_hold_the_kernel(kernel, seed):
    counted = escaped(kernel, seed)
    assert counted["escaped"] == 0
    assert counted["boxes"] >= 50
    assert counted["finite"] >= 0.8 * counted["boxes"]


@over(KINKED)
def test_values_at_the_kinks(kernel):
    """At the end of the support the enclosure is narrow, whichever branch is taken for a ball that contains it."""
    with mp.workdps(DIGITS), ball_arithmetic():
        for kink in kinks(kernel):
            for r in (kink, np.nextafter(kink, -9), np.nextafter(kink, 9)):
                for uncertain in (arb(r), arb(r) + arb(0, 1) * arb(2) ** -140, arb(r) * 3 / 3):
                    value = balls_of(kernel).value(uncertain)
                    number = arb(mp.nstr(exactly(kernel, Differences(float(r), 1.0), 0.0), DIGITS + 5))
                    assert not abs(value.mid() - number) > value.rad() + arb(10) ** -44
                    assert value.rad() < 1e-38


@pytest.mark.parametrize("kernel", PAIR, ids=str)
def test_nothing_is_left_beyond_the_support(kernel):
    with ball_arithmetic():
        length = arb(kernel.lengthscale)
        for distance in (length, length + arb(2) ** -150, 2 * length, arb(10) ** 60):
            size, slope = balls_of(kernel).beyond(distance)
            assert size.is_zero()
            assert slope.is_zero()
        size, slope = balls_of(kernel).beyond(length + arb(0, 1) * arb(2) ** -100)
        assert 0 < size.abs_upper() < arb(2) ** -400
        assert balls_of(kernel).beyond(length * (1 - arb(2) ** -20)).size > 0


@pytest.mark.parametrize("kernel", PAIR, ids=str)
def test_both_branches_agree_about_a_difference_that_may_be_on_either_side(kernel):
    """Series, disc and jump take the same branch for the same ball; on either one the jump bounds the other."""
    balls = balls_of(kernel)
    with ball_arithmetic(4):
        for r in (arb(kernel.lengthscale) + arb(0, 1) * arb(2) ** -90, arb(kernel.lengthscale)):
            assert balls.on_disc(r, arb(0.1)) > 0
            assert balls.jump(r, arb(0.1)) > 0
        just_over = arb(kernel.lengthscale) + arb(2) ** -90
        assert balls.on_disc(just_over, arb(0.1)).is_zero()
        assert balls.jump(just_over, arb(0.1)) > 0
        assert balls.jump(just_over, arb(2) ** -91).is_zero()


def test_a_box_with_both_kinks_and_a_middle_beyond_them_has_no_enclosure():
    """There the branch of the middle is zero, whose odd powers are none: those at the kink say nothing about it."""
    kernel = balls_of(Sum(PiecewisePolynomial2(1.0, 0.5), Matern52(1.0, 0.5)))
    with ball_arithmetic(TERMS):
        for middle, finite in ((0.6, False), (0.51, False), (0.49, True), (0.1, True)):
            expansion = Expansion(arb(1), arb(2), TERMS)
            assert kernel.missed(arb(middle), expansion, 0).is_finite() == finite


@pytest.mark.parametrize("kernel", PAIR, ids=str)
def test_sensitivities_are_bounds(kernel):
    r = np.linspace(0, 1.2, 20001) * kernel.lengthscale
    value, slope = np.abs(kernel.jet(r, 1))
    with ball_arithmetic(2):
        bounds = balls_of(kernel).sensitivity(arb(1e60))
    for bound, found in zip(bounds, (value, slope, r * slope, r * value), strict=False):
        assert np.max(found) <= float(bound) <= 3 * np.max(found)


def no_jump(monkeypatch):
    monkeypatch.setattr(PiecewisePolynomialBalls, "jump", lambda *_: arb(0))


def one_branch(monkeypatch):
    """The polynomial is continued for ever, and nobody notices."""
    monkeypatch.setattr(PiecewisePolynomialBalls, "_is_inside", lambda *_: True)
    monkeypatch.setattr(PiecewisePolynomialBalls, "jump", lambda *_: arb(0))


def half_a_jump(monkeypatch):
    right = PiecewisePolynomialBalls.jump
    monkeypatch.setattr(PiecewisePolynomialBalls, "jump", lambda *arguments: right(*arguments) / 2)


def jump_on_one_side(monkeypatch):
    right = PiecewisePolynomialBalls.jump
    only = lambda self, r, half: right(self, r, half) if self._is_inside(r) else arb(0)  # noqa: E731
    monkeypatch.setattr(PiecewisePolynomialBalls, "jump", only)


def smooth_at_zero(monkeypatch):
    monkeypatch.setattr(PiecewisePolynomialBalls, "is_analytic", True)


def wrong_power(monkeypatch):
    for family in PiecewisePolynomialBalls.__subclasses__():
        monkeypatch.setattr(family, "power", family.power - 1)


FAULTS = [no_jump, half_a_jump, one_branch, jump_on_one_side, smooth_at_zero, wrong_power]


@pytest.mark.parametrize("plant", FAULTS, ids=lambda plant: plant.__name__)
@pytest.mark.parametrize("kernel", PAIR, ids=str)
def test_planted_faults_are_seen(kernel, plant, monkeypatch):
    plant(monkeypatch)
    assert escaped(kernel, most=0)["escaped"] > 0
