"""What a learned reference says of itself: what its bounds cost, and whether it follows its samples."""

from dataclasses import replace

import numpy as np
import pytest

from tests.pipeline.published import example1
from tests.trackably.plants import AXIS, KERNEL, SAMPLES
from trackably import IgnoresSamplesWarning, Polytope, Samples, SquaredExponential, learn_reference
from trackably.gp.joint import JointPosterior
from trackably.reference.explanation import costs
from trackably.reference.fit import Misfit

SLOW = replace(AXIS, state_set=Polytope.box([-1.1, -0.9], [0.2, 0.9]))
LOW = replace(example1.SYSTEM, state_set=Polytope.box([-2.0], [0.001]))


@pytest.fixture(scope="module")
def joint():
    return learn_reference(SAMPLES, SLOW, KERNEL, "all_times", noise_std=0.02)


@pytest.fixture(scope="module")
def alone():
    return learn_reference(SAMPLES, SLOW, KERNEL, "all_times", noise_std=0.02, method="hyperparameters")


def least(reference):
    return reference.fit.unconstrained_posterior.negative_log_marginal_likelihood()[0]


def test_the_price_is_what_the_objective_exceeds_the_least_likelihood_by(joint, alone):
    """J = l(θ) + D(θ) ≥ l(θ) ≥ min l, and D is the sum of the bounds' prices."""
    for found in (joint, alone):
        nlml = JointPosterior(found.prior, found.samples).negative_log_marginal_likelihood()[0]
        assert found.objective == pytest.approx(nlml + sum(b.price for b in found.active_bounds), rel=1e-9)
        assert found.price == pytest.approx(found.objective - least(found), rel=1e-9)
        assert least(found) <= nlml <= found.objective
    assert 0 < joint.price < alone.price
    free = tuple(replace(bound, price=-0.03) for bound in joint.active_bounds)
    limited = costs(replace(joint.fit, limited=("lengthscale",), active_bounds=free))
    assert limited.startswith(f"the bounds and limits of length scales cost {joint.price:.3g} in −2 ln p; for these")
    assert least(joint) == pytest.approx(least(alone), rel=1e-6)


def test_the_gap_is_the_cost_minus_the_dual_with_the_plants_own_bounds(joint, alone):
    """δ = g − m⁺ costs λᵀ K λ, and L_a δ = Σ_b K_ab λ_b; the dual at λ is 2 λᵀ (b − L m⁺) − λᵀ K λ."""
    mean, primal, demanded = joint.fit.posterior.signals, 0.0, 0.0
    for bound in joint.active_bounds:
        quantity, at = joint.reference.quantity(bound.name), np.asarray(bound.time)
        sign = 1.0 if bound.side == "lower" else -1.0
        limit = quantity.bounds.lower if bound.side == "lower" else quantity.bounds.upper
        value, before = quantity(joint.reference.signals, at).item(), quantity(mean, at).item()
        primal += sign * bound.multiplier * (value - before)
        demanded += sign * bound.multiplier * (limit - before)
    assert joint.duality_gap == pytest.approx(primal - (2 * demanded - primal), rel=1e-3)
    assert 0 < joint.duality_gap < 0.01 * joint.price
    assert alone.duality_gap == 0


def test_both_misfits_are_those_of_the_states(joint):
    for reference, said in ((joint.reference, joint.misfit), (joint.unconstrained(), joint.unconstrained_misfit)):
        off = SAMPLES.values - reference.state_at(SAMPLES.times)[:, 0]
        assert said == pytest.approx({"position": np.sqrt(np.mean(off**2))}, rel=1e-9)
    assert joint.unconstrained_misfit["position"] < joint.misfit["position"]


def test_a_reference_that_ignores_its_samples_is_announced_first():
    """Example 1 with an upper bound far below the noise: hyperparameters alone collapse, the function does not."""
    given = example1.SAMPLES, LOW, SquaredExponential(), "all_times"
    known = {"noise_std": 0.01, "mean": 0.0, "starts": 2}
    ignored = "the reference keeps its bounds but does not follow its samples: it is 0."
    with pytest.warns(IgnoresSamplesWarning, match=f'^{ignored}.* a slower .* may help, or method="joint"$') as caught:
        collapsed = learn_reference(*given, **known, method="hyperparameters")
    assert caught[0].filename == __file__
    assert collapsed.explanation.startswith(ignored)
    assert collapsed.misfit["state"] > 20 * 0.01
    followed = learn_reference(*given, **known)
    assert followed.misfit["state"] < 0.01
    assert followed.explanation.startswith("proved")


N = 20
SIGNS = np.tile([1.0, -1.0], N // 2)
RAMP = Samples(np.arange(N), np.linspace(-1, 1, N))
FEW = RAMP.times < 2
LARGE = Misfit("x", RAMP, 0.2 * SIGNS, 0.02 * SIGNS, 0.05, 0.05, True)
HARMLESS = {
    "near the unconstrained fit": {"unconstrained": 0.07 * SIGNS},
    "within the noise": {"noise_unconstrained": 0.21},
    "a hair of the spread": {"off": 0.06 * SIGNS},
    "of noisy samples": {
        "off": np.where(FEW, 2.0, 0.01) * SIGNS,
        "samples": Samples(RAMP.times, RAMP.values, np.where(FEW, 1e3, 1.0)),
    },
}


def test_samples_are_ignored_where_three_conditions_hold():
    assert LARGE.is_large
    assert not [name for name, change in HARMLESS.items() if replace(LARGE, **change).is_large]
