"""Enclosures hold what mpmath computes, wherever one looks."""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, arb_series
from mpmath import mp

from tests.trackable.certificates import naive
from tests.trackable.certificates.instances import case, chosen_box, general_case
from tests.trackable.gp.instances import KERNELS, RADIAL, formula, over, time_scale
from trackable.certificates import limits
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above, float_below
from trackable.certificates.enclosure import Box, enclosure
from trackable.certificates.exact import exact_quantities
from trackable.certificates.kernels.table import balls_of
from trackable.certificates.limits import limits_beyond
from trackable.gp.kernels.base import Kernel
from trackable.gp.kernels.matern import Matern32, Matern52
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.piecewise_polynomial import PiecewisePolynomial2, PiecewisePolynomial3
from trackable.gp.kernels.rational_quadratic import RationalQuadratic
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.signal import KernelSum

EXTREME: dict[str, Kernel] = {
    "tiny": SquaredExponential(1e-3, 1e-9),
    "huge": Matern52(1e4, 1e9),
    "flat": RationalQuadratic(1.0, 1e-4, 0.05),
    "spiky": Periodic(1.0, 0.01, 1.0),
}


def holds(ball: arb, number) -> bool:
    """Whether a ball holds a number of mpmath, to the 50 digits that are certain of both."""
    with ball_arithmetic():
        slack = arb(10) ** -40 * (1 + abs(ball))
        return bool((ball + slack * arb(0, 1)).contains(arb(mp.nstr(number, 55))))


@over(KERNELS | EXTREME)
def test_values(kernel):
    rng = np.random.default_rng(0)
    with mp.workdps(naive.DIGITS), ball_arithmetic():
        for r in [0.0, *(rng.normal(size=30) * 3 * time_scale(kernel))]:
            assert holds(balls_of(kernel).value(arb(r)), formula(kernel)(mp.mpf(r)))


@over(KERNELS)
def test_taylor_coefficients(kernel):
    rng = np.random.default_rng(1)
    for r in rng.uniform(0.05, 3, 4) * time_scale(kernel):
        with mp.workdps(40), ball_arithmetic(5):
            expected = mp.taylor(formula(kernel), mp.mpf(r), 4)
            series = balls_of(kernel).taylor(arb_series([arb(r), 1], prec=5))
            for k, number in enumerate(expected):
                assert float(series[k].mid()) == pytest.approx(float(number), rel=1e-9, abs=1e-12 * float(expected[0]))


@over(RADIAL | EXTREME)
def test_size_on_discs(kernel):
    """Around r > radius, where every branch is the kernel itself, continued by the same formula."""
    rng = np.random.default_rng(2)
    scale = kernel.period * kernel.lengthscale if isinstance(kernel, Periodic) else kernel.lengthscale
    for _ in range(40):
        radius = rng.uniform(0.05, 2) * scale
        r = radius * rng.uniform(1, 5)
        z = mp.mpc(r) + mp.mpf(radius) * mp.expjpi(rng.uniform(0, 2)) * rng.choice([0.5, 0.999])
        size = abs(_CONTINUED.get(type(kernel), _by_formula)(kernel, z, r))
        with ball_arithmetic():
            assert not balls_of(kernel).on_disc(arb(r), arb(radius)) < arb(mp.nstr(size, 30)) * (1 - arb(10) ** -20)


def _by_formula(kernel, z, _):
    return formula(kernel)(z)


def _matern(kernel, z, _):
    nu = 3 if "32" in type(kernel).__name__ else 5
    x = mp.sqrt(nu) * z / kernel.lengthscale
    return mp.mpf(kernel.signal_std) ** 2 * (1 + x + (x**2 / 3 if nu == 5 else 0)) * mp.exp(-x)


def _piecewise_polynomial(kernel, z, r):
    """Return the branch that holds at r."""
    if r >= kernel.lengthscale:
        return mp.mpf(0)
    s = z / mp.mpf(kernel.lengthscale)
    three = isinstance(kernel, PiecewisePolynomial3)
    found = (1 - s) ** 7 * (21 * s**3 + 19 * s**2 + 7 * s + 1) if three else (1 - s) ** 5 * (8 * s**2 + 5 * s + 1)
    return mp.mpf(kernel.signal_std) ** 2 * found


_CONTINUED = {
    Matern32: _matern,
    Matern52: _matern,
    PiecewisePolynomial2: _piecewise_polynomial,
    PiecewisePolynomial3: _piecewise_polynomial,
}


@over(KERNELS | EXTREME)
@pytest.mark.parametrize("distance", [0.0, 0.1, 0.5, 1.0, 2.5])
def test_bounds_beyond_a_distance(kernel, distance):
    distance *= time_scale(kernel)
    farther = distance + np.geomspace(1e-6, 20, 400) * time_scale(kernel)
    with ball_arithmetic(2):
        size, rate = balls_of(kernel).beyond(arb(distance))
    jet = np.abs(kernel.jet(np.append(farther, distance), 1)).max(axis=1)
    assert jet[0] <= float_above(size) * (1 + 1e-12)
    assert jet[1] <= float_above(rate) * (1 + 1e-12)


def _envelope_is_too_small(kernel: Kernel, seed: int) -> bool:
    """Whether a signal's envelope in float64 is smaller than in ball arithmetic; it has to be nearly the same."""
    rng = np.random.default_rng(seed)
    signal = KernelSum(kernel, 0.0, np.sort(rng.uniform(-3, 0, 7)) * time_scale(kernel), rng.normal(size=7))
    too_small = False
    with ball_arithmetic(2):
        for start in (arb(t) * arb(time_scale(kernel)) / 3 for t in (0, 1, 7, 40, 10**12)):
            found = limits._envelope(signal, start)
            decays = [balls_of(kernel).beyond((start - arb(t)).max(arb(0))) for t in signal.centres.tolist()]
            for bound, each in zip(found, zip(*decays, strict=True), strict=True):
                total = sum((abs(arb(c)) * b for c, b in zip(signal.weights.tolist(), each, strict=True)), arb(0))
                too_small |= not bound >= total.mid()
                assert bound <= total * (1 + arb(10) ** -6) + arb(10) ** -250
    return too_small


@over(KERNELS | EXTREME)
def test_envelopes_in_float64_are_no_smaller(kernel, monkeypatch):
    assert not _envelope_is_too_small(kernel, 0)
    monkeypatch.setattr(limits, "sums_up", lambda values, terms: values * (1 - 1e-12))
    assert _envelope_is_too_small(kernel, 0)


def test_floats_of_known_direction():
    with ball_arithmetic():
        third = arb(1) / 3
        assert arb(float_below(third)) < third < arb(float_above(third))
    assert float_above(arb.pos_inf()) == np.inf


@pytest.mark.parametrize(("make", "seed"), [(case, s) for s in range(200, 260)] + [(general_case, s) for s in range(8)])
def test_boxes_hold_the_quantity(make, seed):
    chosen, rng = make(seed), np.random.default_rng(seed)
    for quantity in exact_quantities(chosen.reference):
        start = float(rng.uniform(-0.2, 1) * chosen.end)
        end = start + float(chosen.end * 10 ** rng.uniform(-6, -0.5))
        half = (end - start) / 2
        for box in (chosen_box(quantity, start, end, 12), Box(start, end, 1.7 * half)):
            found = enclosure(quantity, box, 12)
            for t in [start, end, *rng.uniform(start, end, 5)]:
                with mp.workdps(naive.DIGITS), ball_arithmetic():
                    middle, width = (arb(start) + arb(end)) / 2, (arb(end) - arb(start)) / 2
                    polynomial = found.coefficients((arb(t) - middle) / width)
                    off = abs(polynomial - arb(mp.nstr(naive.exactly(chosen.reference, quantity.name, t), 55)))
                    assert not off > found.remainder + arb(10) ** -30 * (1 + abs(polynomial))


@pytest.mark.parametrize(("make", "seed"), [(make, seed) for make in (case, general_case) for seed in range(40)])
def test_limits_hold_from_their_start_on(make, seed):
    chosen = make(seed)
    start = 0.6 * chosen.end
    limits = limits_beyond(chosen.reference, arb(start))
    times = start + np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 200) * chosen.end])
    for name, (centre, reach) in limits.items():
        off = np.abs(naive.extended(chosen.reference, name, times) - float(centre.mid()))
        assert np.max(off) <= float_above(reach) * (1 + 1e-9) + 1e-12 * abs(float(centre.mid()))


def test_stays_in_means_what_it_says():
    chosen = case(1)
    state = exact_quantities(chosen.reference)[0]
    box = chosen_box(state, 0.0, chosen.end / 64, 16)
    values = naive.extended(chosen.reference, "state", np.linspace(box.start, box.end, 400))
    low, high = float(np.min(values)), float(np.max(values))
    slack = 1e-6 * (high - low) + 1e-9 * abs(high)
    inside = enclosure(state, box, 16)
    assert inside.stays_in(arb(low - slack), arb(high + slack))
    assert not inside.stays_in(arb(low + slack), arb(high + slack))
    assert not inside.stays_in(arb(low - slack), arb(high - slack))
    assert not enclosure(state, replace(box, radius=box.end / 4), 16).stays_in(arb(low - 1), arb(high + 1))
