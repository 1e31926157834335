"""Bounds of all that is farther than a distance hold on the discs of every farther difference."""

import numpy as np
import pytest
from flint import arb
from mpmath import mp

from tests.trackable.gp.instances import KERNELS, formula, over, time_scale
from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.floats.balls import Balls
from trackable.certificates.kernels.matern import Matern52Balls
from trackable.certificates.kernels.squared_exponential import SquaredExponentialBalls
from trackable.certificates.kernels.table import balls_of
from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.matern import Matern52
from trackable.gp.kernels.squared_exponential import SquaredExponential


def escapes(kernel: Kernel, seed: int) -> bool:
    """Whether a bound is smaller than that of some disc, or than the kernel there."""
    rng, balls, scale = np.random.default_rng(seed), balls_of(kernel), time_scale(kernel)
    with ball_arithmetic():
        for _ in range(10):
            radius = scale * 10 ** rng.uniform(-2, 0.5)
            distance = radius * 10 ** rng.uniform(0, 1.5)
            bound = balls.far(arb(distance), arb(radius)) * (1 + arb(10) ** -30)
            for r in (distance * np.concatenate([[1.0], 10 ** rng.uniform(0, 2, 8)])).tolist():
                if balls.value(arb(r + radius * rng.uniform(-0.99, 0.99))) > bound:
                    return True
                if not balls.has_periodic_part and balls.on_disc(arb(r), arb(radius)) > bound:
                    return True  # arb's cosines of wide balls are crude
                if not kernel.is_analytic:
                    continue
                z = mp.mpc(r) + mp.mpf(radius) * mp.expjpi(rng.uniform(0, 2))
                if bound.is_finite() and arb(mp.nstr(abs(formula(kernel)(z)), 30)) * (1 - arb(10) ** -20) > bound:
                    return True
    return False


@over(KERNELS)
@pytest.mark.parametrize("seed", range(3))
def test_nothing_farther_is_larger(kernel, seed):
    assert not escapes(kernel, seed)


def test_a_bound_of_what_is_twice_as_far_is_seen(monkeypatch):
    right = Matern52Balls.far
    monkeypatch.setattr(Matern52Balls, "far", lambda self, distance, radius: right(self, 2 * distance, radius))
    assert escapes(Matern52(1.0, 1.0), 0)


def exceeds(kernel: Kernel, seed: int) -> bool:
    """Whether κ or κ̇ is larger than its bound from some distance on, in either arithmetic, or than that of all r."""
    rng, balls, scale = np.random.default_rng(seed), balls_of(kernel), time_scale(kernel)
    distances = np.append(0.0, scale * 10 ** rng.uniform(-2, 1, 9))
    with np.errstate(all="ignore"), ball_arithmetic(2):
        alike = [balls.beyond(Balls.exact(some)) for some in (distances, distances[distances >= scale])]
        highest, steepest = (np.append(*(bounds[i].highest for bounds in alike)) for i in range(2))
        for i, d in enumerate([*distances, *distances[distances >= scale]]):
            one = balls.beyond(arb(d))
            for r in d + scale * np.append(0.0, 10 ** rng.uniform(-3, 1, 20)):
                value, slope = (np.abs(x) * (1 - 1e-12) for x in kernel.jet(np.asarray(r), 1).tolist())
                bounds = [(one.size, one.slope), (balls.largest.size, balls.largest.slope)]
                if any(value > size or slope > speed for size, speed in bounds):
                    return True
                if value > highest[i] or slope > steepest[i]:
                    return True
    return False


@over(KERNELS)
@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_larger_or_steeper_from_a_distance_on(kernel, seed):
    assert not exceeds(kernel, seed)


def test_a_bound_from_where_it_is_steepest_is_seen(monkeypatch):
    right = SquaredExponentialBalls.beyond
    monkeypatch.setattr(SquaredExponentialBalls, "beyond", lambda self, r: right(self, r.max(self.length)))
    assert exceeds(SquaredExponential(1.0, 1.3), 0)
