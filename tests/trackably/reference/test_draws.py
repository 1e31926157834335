"""Draws given samples and bounds, and bands: within the bounds, true to the samples, and about the truth."""

from dataclasses import replace
from functools import cache

import numpy as np

from tests.pipeline.published import example1
from tests.trackably.checker.redundant import learned as redundant
from tests.trackably.systems.instances import unbounded
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.reference.draws import band, bounded_steps, draws_within_bounds
from trackably.reference.learn import learn_reference
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

WITHIN = np.arange(61)  # from the first sample to the last


def plant(lower, upper):
    return replace(example1.SYSTEM, state_set=Polytope.box([lower], [upper]))


@cache
def learned():
    return learn_reference(
        example1.SAMPLES, plant(-2.0, 0.01), SquaredExponential(), "all_times", noise_std=0.01, starts=2
    )


def given(kernel, noise_std, samples, mean=0.0):
    return JointPosterior(JointPrior((Prior(kernel, noise_std, mean),)), (samples,))


def drawn(posterior, sets, k, count):
    return draws_within_bounds(Reference(posterior.signals, sets), posterior, k, np.empty(0), count, 0)


def assert_kept(sets, states, inputs):
    """Every draw keeps all bounds, up to rounding."""
    assert np.min(sets.state_set.margin(states)) >= 0
    assert np.min(sets.input_set.margin(inputs)) >= -1e-12


def test_every_draw_keeps_the_bounds_and_follows_the_system():
    states, inputs = learned().draws(np.arange(101), 2000)
    assert states.shape == inputs.shape == (2000, 101, 1)
    assert_kept(sets := learned().reference.plant, states, inputs)
    np.testing.assert_allclose(sets.system.successor(states[:, :-1], inputs[:, :-1]), states[:, 1:], atol=1e-6)
    off = states[:, WITHIN[::10], 0] - learned().samples[0].values
    assert np.max(np.abs(np.mean(off, axis=0))) < 0.01
    (lower, upper), _ = learned().bands(np.arange(101), 0.8, 2000)
    np.testing.assert_array_equal((lower, upper), band(states, 0.8))


def test_bounds_are_also_imposed_where_a_posterior_mean_is_next_to_them():
    """Without bounds that are active, and would tell it."""
    t = np.linspace(0.0, 30.0, 300)
    posterior = given(SquaredExponential(0.7, 0.4), 0.05, Samples(t, np.sin(3.7 * t)))
    values = posterior.signals[0](0.01 * np.arange(3001))
    near = replace(plant(-9.0, np.max(values) + 1e-3), input_set=Polytope.box([-99.0], [99.0]))
    assert np.argmax(values) in bounded_steps(Reference(posterior.signals, near), posterior.samples, (0.0, 30.0))


def test_bounds_that_move_are_kept():
    falling = PolynomialPieces.lines({0.0: 0.3, 0.6: 0.02})
    k = WITHIN[::6]
    states, _ = drawn(learned().fit.posterior, plant(-2.0, falling), k, 500)
    above = states[..., 0] - falling(k * 0.01)
    assert np.max(above) <= 0
    assert np.max(above[:, -1]) > -1e-3


def test_bounds_that_are_far_away_leave_the_posterior_as_it_is():
    posterior = JointPosterior(learned().prior, learned().samples)
    free, k = unbounded(example1.SYSTEM.system), np.array([[3, 15], [44, 71]])
    states, inputs = drawn(posterior, free, k, 4000)
    free = Reference(posterior.signals, free)
    found = replace(learned(), fit=replace(learned().fit, reference=free))
    for values, mean, std in ((states, free.state(k), found.state_std(k)), (inputs, free.input(k), found.input_std(k))):
        np.testing.assert_allclose(np.mean(values, axis=0), mean, atol=4 * np.max(std) / np.sqrt(4000))
        np.testing.assert_allclose(np.std(values, axis=0), std, rtol=0.05)


def test_bands_hold_as_much_as_they_promise_of_truths_from_the_prior():
    """Averaged over truths that keep the bounds, and noise, a credible set holds the truth as often as it says."""
    k = np.arange(0.0, 12.0)
    kernel, sets = Matern52(1.0, 0.05), replace(plant(-0.4, 0.6), input_set=Polytope.box([-9.0], [9.0]))
    half = np.linalg.cholesky(kernel((k[:, None] - k) * 0.01) + 1e-9 * np.eye(12))
    rng = np.random.default_rng(4)
    truths = rng.standard_normal((3000, 12)) @ half.T
    truths = truths[np.all((truths > -0.4) & (truths < 0.6), axis=1)][:40]
    assert len(truths) == 40
    held = []
    for truth in truths:
        samples = Samples(k[::3] * 0.01, truth[::3] + 0.3 * rng.standard_normal(4))
        states, _ = drawn(given(kernel, 0.3, samples), sets, k, 150)
        lower, upper = band(states[..., 0], 0.8)
        held.append((lower <= truth) & (truth <= upper))
    assert 0.75 < np.mean(held) < 0.85


def test_of_redundant_inputs_every_draw_takes_admissible_ones():
    found, k = redundant(), np.arange(0, 80, 2)
    states, inputs = found.draws(k, 100)
    assert_kept(found.reference.plant, states, inputs)
    assert np.any(np.abs(inputs[..., 1]) > 0.2 - 1e-9)


def test_inputs_of_a_nonlinear_system_are_drawn_to_first_order():
    tank = NonlinearSystem.of(lambda x, u: [x[0] + 0.1 * (u[0] - 0.6 * np.sqrt(x[0]))], ("level",), ("inflow",), 0.1)
    sets = ConstrainedSystem(tank, Polytope.box([0.5], [1.3]), Polytope.box([0.0], [0.84]))
    samples = Samples([0.0, 0.5, 1.0, 1.5], [1.0, 1.1, 1.2, 1.2])
    posterior, k = given(SquaredExponential(0.3, 1.0), 0.02, samples, 1.0), np.arange(15)
    states, inputs = drawn(posterior, sets, k, 200)
    assert_kept(sets, states, inputs)
    assert np.max(Reference(posterior.signals, sets).input(k)) > 0.84
    x = states[:, :-1, 0]
    exactly = (states[:, 1:, 0] - x) / 0.1 + 0.6 * np.sqrt(x)
    np.testing.assert_allclose(inputs[:, :-1, 0], exactly, atol=0.01)
