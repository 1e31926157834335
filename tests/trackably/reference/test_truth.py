"""Bounds of the true signal hold for every signal of the class, are nearly the best there are, and are checked."""

import copy
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from unittest import mock

import numpy as np
import pytest
from scipy.interpolate import PPoly

from tests.trackably.checker.changes import changed
from tests.trackably.gp.instances import over
from tests.trackably.plants import SLIDE
from tests.trackably.saved import assert_comes_back
from tests.trackably.systems.disturbance.instances import CART
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    NoSignal,
    NotTrackableError,
    Polytope,
    Samples,
    SquaredExponential,
    Truth,
    Zonotope,
    learn_reference,
)
from trackably.certificates.form import encode_certificate
from trackably.certificates.outcome import TooFar
from trackably.checker import Contradicted, Failed, NotACertificate, Proved, check
from trackably.checker.boxes import Box
from trackably.checker.certificate import AllTimes, Measured, SignalClass, TrueSignal
from trackably.checker.truth import extreme, places, side
from trackably.reference.truth import Signals, _derive, no_signal, sides_at, true_signals

NOISE, LIMIT = 0.002, 0.5


class BangBang:
    """A signal whose second derivative is ± M, with random switches."""

    def __init__(self, seed, M=LIMIT):
        draw = np.random.default_rng(seed)
        knots = np.cumsum(np.concatenate([[0.0], draw.exponential(0.2, 60)]))
        self.rate = PPoly(M * draw.choice([-1.0, 1.0], (1, 60)), knots).antiderivative()
        self.rate.c[-1] += 0.1 * draw.normal()
        self.value = self.rate.antiderivative()
        self.value.c[-1] += 0.05 * draw.normal()

    def __call__(self, t):
        return self.value(t)


def measured(of, draw, count=12):
    """Return the class of a signal whose measurements are off by all of their noise."""
    t, s = (np.unique(draw.uniform(0.0, 4.0, n)) for n in (count, 4))
    values = of(t) + NOISE * draw.choice([-1.0, 1.0], len(t))
    rates = of.rate(s) + 0.01 * draw.choice([-1.0, 1.0], len(s))
    steepest = float(np.max(np.abs(of.rate(np.linspace(0.0, 4.5, 4501))))) + 1e-3
    noise = NOISE * (1 + 1e-9)
    return SignalClass(
        Measured(tuple(t), tuple(values), noise), Measured(tuple(s), tuple(rates), 0.0101), steepest, LIMIT
    )


def nearly_known(seed):
    """Return 25 samples that are off by all of their noise, and their signal, which has little freedom left."""
    draw, f = np.random.default_rng([seed, 7]), BangBang(seed, 0.97 * LIMIT)
    t = np.sort(draw.choice(np.arange(0.0, 2.0, 0.02), 25, replace=False))
    return Samples(t, f(t) + NOISE * draw.choice([-1.0, 1.0], len(t))), f


@pytest.mark.parametrize("seed", [31090, 31102])  # coarse programs find no signal, or loose bounds
def test_derived_bounds_are_nearly_reached_where_few_signals_explain_the_samples(seed):
    samples, _ = nearly_known(seed)
    t, y = samples.times, samples.values
    of = SignalClass(Measured(tuple(t), tuple(y), NOISE * (1 + 1e-9)), None, None, LIMIT)
    for at in np.linspace(t[0], t[-1], 8)[1:-1]:
        lower, upper = (Signals.of(of, (at,), 64).extreme(at, sign)[0] for sign in (-1, 1))
        derived = _derive(of, at)
        assert extreme(of, derived, 1) <= upper + 0.1 * NOISE
        assert extreme(of, derived, -1) >= lower - 0.1 * NOISE


@pytest.mark.parametrize("seed", range(5))
def test_every_side_bounds_every_signal_that_explains_the_samples(seed):
    draw, f = np.random.default_rng(seed), BangBang(seed, 0.9 * LIMIT)
    of = measured(f, draw)
    n, x = len(of.samples.times), np.linspace(-1.0, 1.0, 21)
    derived = tuple(_derive(of, t) for t in (0.5, 1.3, 2.9, 3.0))
    every = places(TrueSignal("", of, (), (), 0, (), (), (), None, derived))
    ends = np.unique([*of.samples.times, *of.rates.times, 0.0, 0.5, 1.3, 2.9, 3.0, 4.5])
    for a, b in pairwise(ends):
        for _ in range(15):
            pair = int(draw.integers(n)), int(draw.integers(n + 8))
            for sign in (1, -1):
                found = side(of, pair, sign, Box(a, b, 1.0), every)
                there = float(found[0]) + float(found[1]) * x + float(found[2]) * x**2
                assert np.all(sign * (there - f((a + b) / 2 + (b - a) / 2 * x)) >= -1e-12)
    for known in derived:
        low, high = (extreme(of, known, sign) for sign in (-1, 1))
        assert low - Fraction(1, 10**12) <= Fraction(float(f(np.array(known.time)))) <= high + Fraction(1, 10**12)


few_cells = mock.patch("trackably.reference.truth._CELLS", 75)
"""With a quarter of the cells, which takes about a quarter of the time."""


@pytest.fixture(scope="module")
@few_cells
def learned():
    draw = np.random.default_rng(0)
    t = np.arange(0.0, 3.0, 0.1)
    values = 0.1 * np.sin(1.5 * t) + draw.uniform(-NOISE, NOISE, len(t))
    known = Samples(t, values), SLIDE, SquaredExponential(), (0.0, 2.9)
    return learn_reference(*known, noise_std=NOISE, truth=Truth(NOISE, second_derivative=LIMIT), starts=1)


def test_the_error_is_proved_stated_and_nearly_the_largest(learned):
    (truth,) = learned.certificate.truth
    verdict = check(encode_certificate(learned.certificate))
    assert isinstance(verdict, Proved)
    assert f"|x_r(t) - f(t)| ≤ {truth.error!r}" in verdict.statement
    times = np.linspace(0.0, 2.9, 3001)
    upper, lower = sides_at(truth, times)
    x = learned.reference.state_at(times)[:, 0]
    largest = float(np.max(np.maximum(upper - x, x - lower)))
    assert largest <= truth.error <= 1.02 * largest
    found = learned.accuracy()
    assert found.radius <= found.error
    assert found.least <= found.error
    assert found.radius <= float(np.max(upper - lower)) / 2 + 1e-9


T = np.arange(0.0, 0.55, 0.1)
NEAR = Samples(T, 0.08 * np.sin(1.8 * T) + np.random.default_rng(0).uniform(-0.001, 0.001, T.size))
COARSE = {"noise_std": 0.01, "truth": Truth(0.001, second_derivative=0.4), "starts": 1}


@few_cells
def learned_near(plant=SLIDE, **more):
    return learn_reference(NEAR, plant, SquaredExponential(), (0.0, 0.5), **COARSE, **more)


@pytest.fixture(scope="module")
def far():
    """With noise that is thought larger than it is, the reference is further from the signal than it could be."""
    return learned_near()


def test_a_tolerance_below_the_error_of_what_is_learned_is_kept_by_a_state_that_has_no_other_bounds(far):
    wanted, pushed = 0.9 * far.accuracy().error, Zonotope.box([0.0, -5e-5], [0.0, 5e-5])
    free = replace(SLIDE, state_set=Polytope.box([-np.inf, -0.5], [np.inf, 0.5]))
    found = learned_near(free, disturbance=pushed, tolerance=wanted)
    (truth,) = found.certificate.truth
    assert truth.error < truth.plant <= wanted < far.accuracy().error
    assert isinstance(check(encode_certificate(found.certificate)), Proved)


def test_a_tolerance_that_no_reference_reaches_is_refused_with_the_least(far):
    least = far.accuracy().least
    with pytest.raises(NotTrackableError, match="linear program finds references for tolerances above") as raised:
        learned_near(tolerance={"position": 0.9 * least})
    assert isinstance(raised.value.outcome, TooFar)
    assert raised.value.outcome.radius == pytest.approx(far.accuracy().radius)
    assert least <= raised.value.outcome.least <= 1.2 * far.accuracy().error


def test_a_tolerance_that_what_is_learned_without_it_keeps_is_proved():
    """The sides of the truth leave so little room beyond the least tolerance that no bounds are imposed."""
    rate = LinearSystem.discretised([[0.0, 1.0], [0.0, -2.0]], [[0.0], [10.0]], 0.02)
    plant = ConstrainedSystem(rate, Polytope.box([-60.0, -90.0], [60.0, 90.0]), Polytope.box([-60.0], [60.0]))
    draw = np.random.default_rng(9)
    t = np.unique(np.round(draw.uniform(0, 4, 60), 3))
    samples = Samples(t, np.round((30 * np.sin(1.5 * t) + draw.uniform(-0.1, 0.1, t.size)) / 0.1) * 0.1)
    truth, kernel, most = Truth(0.15, second_derivative=80.0), SquaredExponential(), 0.8916
    assert learn_reference(samples, plant, kernel, "recorded", truth=truth, tolerance=most).accuracy().error <= most


def test_what_is_saved_comes_back(learned, tmp_path):
    assert_comes_back(learned, tmp_path)


CHANGES = {
    "noise": ("of.samples.noise", 0.004),
    "bound": ("of.second_derivative", 1.0),
    "upper side": ("upper.3", [0, 0]),
    "lower side": ("lower.3", [0, 0]),
    "pair": ("upper.3", [0, 1000]),
    "sample": ("of.samples.values.7", 0.5),
    "state": ("state", "velocity"),
    "nobody": ("state", "nobody"),
    "plant": ("plant", 1.0),
    "cells": ("ends", lambda ends: ends[::-1]),
    "count": ("errors", lambda errors: errors[:-1]),
    "errors": ("errors", lambda errors: [0.99 * error for error in errors]),
    "times": ("of.samples.times", lambda times: times[::-1]),
    "multiplier": ("derived.0.upper.0.1", "1/3"),
    "measurement": ("derived.0.lower.0.0", 10**6),
    "time": ("derived.0.time", lambda time: time + 1e-9),
    "underivable": ("derived", lambda derived: derived[1:]),
}


@over(CHANGES, "path", "put")
def test_a_changed_truth_is_refused(learned, path, put):
    content = changed(encode_certificate(learned.certificate), f"truth.0.{path}", put)
    assert isinstance(check(content), Failed | NotACertificate)


def test_cells_that_only_exact_arithmetic_encloses_are_checked(learned):
    content = encode_certificate(learned.certificate)
    (truth,) = copy.deepcopy(content["truth"])
    for name in ("ends", "radii", "upper", "lower", "errors"):
        truth[name] = truth[name][: 3 if name == "ends" else 2]
    assert isinstance(check({**content, "truth": [truth]}, exact=True), Proved)


@pytest.mark.parametrize("seed", range(6))
def test_samples_of_a_signal_are_never_contradicted_and_planted_faults_always(seed):
    draw, f = np.random.default_rng(seed), BangBang(seed)
    of = measured(f, draw)
    of = [of, replace(of, rates=None), replace(of, slope=None), replace(of, second_derivative=None, rates=None)][
        seed % 4
    ]
    assert no_signal("position", of) is None
    values = list(of.samples.values)
    values[5] += 10.0
    found = no_signal("position", replace(of, samples=replace(of.samples, values=tuple(values))))
    assert isinstance(found, NoSignal)
    assert isinstance(check(found.contradiction), Contradicted)
    assert isinstance(check(changed(dict(found.contradiction), ("of", "samples", "noise"), 20.0)), Failed)


def test_learning_refuses_samples_that_no_signal_explains():
    t = np.arange(0.0, 2.0, 0.25)
    with pytest.raises(NotTrackableError, match="no true signal explains") as raised:
        learn_reference(
            Samples(t, 0.1 * np.sin(3 * t)), SLIDE, SquaredExponential(), (0.0, 1.5), truth=Truth(1e-3, slope=0.05)
        )
    assert isinstance(raised.value.outcome, NoSignal)


def test_a_tolerance_bounds_the_state_on_both_sides_of_its_true_signals():
    t = np.linspace(0.0, 2.0, 9)
    given = {"position": Samples(t, 0.5 * np.sin(t))}
    plant, (sought,) = true_signals(Truth(0.02, second_derivative=0.5), 0.2, given, CART, AllTimes())
    at = np.linspace(0.01, 1.99, 40)
    upper, lower = sides_at(sought, at)
    low, high = plant.state_set.bounds[-1].ends(at)
    assert np.all(low >= upper - 0.2)
    assert np.all(high <= lower + 0.2)
