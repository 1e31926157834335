"""Values at given times: met up to a tolerance that is proved, or refused."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.trackably.plants import AXIS, CART, SAMPLES
from tests.trackably.saved import assert_comes_back
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    NonlinearSystem,
    NotTrackableError,
    PolynomialPieces,
    Polytope,
    Proved,
    Samples,
    SquaredExponential,
    Unproved,
    check,
    learn_reference,
)
from trackably.reference.waypoints import Waypoint, prove_waypoints
from trackably.systems.intervals import Interval

KNOWN = SquaredExponential(0.5, 0.6)
AT = {1.0: {"force": -1.0}, 0.0: {"position": -0.98, "velocity": 0.0}}
TANK = ConstrainedSystem(
    NonlinearSystem.of(lambda x, u: [x[0] + 0.1 * u[0] - 0.05 * x[0] ** 2], ["level"], ["inflow"], 0.1),
    Polytope.box([0.1], [2.0]),
    Polytope.box([-2.0], [4.0]),
)
LIFT = ConstrainedSystem(
    LinearSystem.discretised(np.eye(3, k=1), [[0.0], [0.0], [1.0]], 0.02, states=["height", "speed", "acceleration"]),
    Polytope.box([-1.0, -2.0, -3.0], [2.0, 2.0, 3.0]),
    Polytope.box([-9.0], [9.0]),
)


def learned(at):
    return learn_reference({"position": SAMPLES}, AXIS, KNOWN, "all_times", noise_std=0.02, at=at)


@pytest.fixture(scope="module")
def axis():
    return learned(AT)


def test_values_are_met_within_a_ten_thousandth_of_their_bounds(axis):
    assert np.all(np.abs(axis.state(0) - [-0.98, 0.0]) <= [1.3e-4, 2e-4])
    np.testing.assert_allclose(axis.input(20), [-1.0], atol=5e-4, rtol=0)
    assert "position = -0.98 ± 0.00013, velocity = 0 ± 0.0002 at 0 s; force = -1 ± 0.0005 at 1 s" in axis.explanation
    with pytest.raises(NotTrackableError, match="it is missed"):  # a hundredth of the width is not enough either
        prove_waypoints(axis.reference, [Waypoint(0.3, {"position": 0.1}, {"position": 1e-4})], {"position"})


def test_a_certificate_for_each_time_proves_it(axis, tmp_path):
    verdicts = [check(file) for file in axis.save_certificate(tmp_path / "proof.json")]
    assert [type(verdict) for verdict in verdicts] == [Proved] * 3
    assert 'the reference keeps -0.98013 ≤ "position" ≤ -0.97987' in verdicts[1].statement


def test_values_lie_inside_of_the_bounds_at_their_time():
    closing = PolynomialPieces.lines({0.0: 0.2, 2.0: 0.05, 3.0: 0.2})
    plant = replace(AXIS, state_set=Polytope.box([-1.1, -1.0], [closing, 1.0]))
    learn = partial(learn_reference, SAMPLES, plant, KNOWN, (0.0, 3.0), noise_std=0.02)
    found = learn(at={2.0: {"position": 0.05}})
    assert found.state(40)[0] == pytest.approx(0.05, abs=2e-4)
    with pytest.raises(ValueError, match=r"at: position must be inside \[-1\.1, 0\.05\] at 2 s, got 0\.1"):
        learn(at={2.0: {"position": 0.1}})


def curve(low, high):
    """From one level to another in 3 s, with noise."""
    t = np.arange(0.0, 3.01, 0.15)
    part = np.clip(t / 3.0, 0.0, 1.0)
    noise = 0.003 * np.random.default_rng(0).normal(size=len(t))
    return Samples(t, low + (high - low) * (10 * part**3 - 15 * part**4 + 6 * part**5) + noise)


RESTING = {
    "a tank": (TANK, {"level": curve(0.6, 1.5)}),
    "errors above 1e-4 of the width": (LIFT, {"height": curve(0.0, 1.0)}),
    "two outputs": (CART, {"a": curve(-0.3, 0.2), "b": curve(0.1, -0.4)}),
}


@pytest.mark.parametrize("name", RESTING)
def test_at_rest_the_system_stays_where_it_is_with_the_input_that_holds_it(name, tmp_path):
    plant, samples = RESTING[name]
    at = {0.0: "rest", 3.0: "rest"}
    found = learn_reference(samples, plant, SquaredExponential(1.0, 1.0), (0.0, 3.0), noise_std=0.02, at=at)
    assert [pinned.time for pinned in found.fit.pinned] == [*at]
    for pinned in found.fit.pinned:
        k = round(pinned.time / plant.sampling_time)
        x, u = (np.array([pinned.values[of] for of in names]) for names in (plant.system.states, plant.system.inputs))
        np.testing.assert_allclose(plant.system.successor(x, u), x, rtol=0, atol=1e-12)
        tolerances = np.array([pinned.tolerances[of] for of in plant.system.states])
        for step in (k, k + 1):
            assert np.all(np.abs(found.reference.state(step) - x) <= tolerances)
    assert len(found.pin_certificates) == len(at)
    assert_comes_back(found, tmp_path)


@pytest.mark.parametrize(("shortfall", "advised"), [(1e-5, "at_tolerance, such as 0.00404"), (np.inf, None)])
def test_a_larger_tolerance_is_advised_where_it_may_help(shortfall, advised):
    failure = Unproved("x", Interval(-1e-3, 1e-3), (1.0, 1.0), shortfall, "it may be undefined")
    said = Waypoint(1.0, {"x": 0.0}, {"x": 1e-3}).missed(failure).explanation
    assert advised in said if advised else said.endswith("it may be undefined")
