"""What is refuted is repaired: the result is proved, near, and says how far it is from what was given."""

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PchipInterpolator, make_interp_spline

from tests.trackably.plants import AXIS, CART, SAMPLES
from trackably import (
    CertifiedReference,
    ConstrainedSystem,
    Counterexample,
    Polytope,
    Proved,
    certify,
    check,
    repair,
)

X, Y = [0.0, 1.0, 2.0, 3.0], [-1.0, -0.6, -0.5, 0.0]
FAST = make_interp_spline(np.arange(7.0), [-1.2, -0.2, -0.9, -0.2, -0.5, 0.1, -1.2], k=5, bc_type="periodic")
CASES = {
    "stops at once": (PchipInterpolator(X, Y), "all_times"),
    "has kinks": (make_interp_spline(X, Y, k=1), None),
    "too fast": (FAST, "all_phases"),
    "noisy samples": (CubicSpline(SAMPLES.times, SAMPLES.values), None),
}


@cache
def repaired(case):
    curve, claim = CASES[case]
    return repair(curve, AXIS, claim)


@pytest.mark.parametrize("case", CASES)
def test_what_was_refuted_is_proved_after_a_repair(case, tmp_path):
    curve, claim = CASES[case]
    assert isinstance(certify(curve, AXIS, claim), Counterexample)
    found = repaired(case)
    assert isinstance(found, CertifiedReference)
    assert isinstance(check(*found.save_certificate(tmp_path / "proof.json")), Proved)
    moved = found.moved["position"]
    assert 0 < moved.rms < moved.most < 0.3
    if case != "noisy samples":
        t = np.linspace(0, 3.0 if claim != "all_phases" else 6.0, 4001)
        apart = np.abs(found.reference.state_at(t)[:, 0] - curve(t))
        assert np.max(apart) == pytest.approx(moved.most, rel=1e-2)
        assert np.sqrt(np.mean(apart**2)) == pytest.approx(moved.rms, rel=2e-2)


def test_nothing_is_much_nearer():
    """With inputs that are free, the nearest curve is the given one, cut off at the bound."""
    plant = ConstrainedSystem(CART.system, Polytope.box([-1, -9], [0.5, 9]), Polytope.box([-99, -99], [99, 99]))
    curve, still = CubicSpline([0, 1, 2, 3], [0, 1, -0.2, 0]), CubicSpline([0, 1, 2, 3], [0, 0, 0, 0])
    found, t = repair({"a": curve, "b": still}, plant), np.linspace(0, 3, 4001)
    assert isinstance(found, CertifiedReference)
    cut = np.sqrt(np.mean((curve(t) - np.clip(curve(t), -1, 0.5)) ** 2))
    assert cut <= found.moved["a"].rms + 1e-6
    assert found.moved["a"].rms <= 1.01 * cut
    assert found.moved["b"].most < 1e-6


def test_a_repaired_trajectory_begins_where_the_given_one_does():
    """A system that is there cannot begin elsewhere; where it may, the result is nearer."""
    curve, claim = CASES["stops at once"]
    given = certify(curve, ConstrainedSystem(AXIS.system, *(Polytope.box([-99] * n, [99] * n) for n in (2, 1))), claim)
    kept, free = repaired("stops at once"), repair(curve, AXIS, claim, start="free")
    assert kept.state(0) == pytest.approx(given.state(0), abs=1e-6)
    assert free.state(0) != pytest.approx(given.state(0), abs=1e-3)
    assert free.moved["position"].rms < kept.moved["position"].rms


def test_a_start_that_breaks_a_bound_is_moved():
    curve = CubicSpline(X, [-1.3, -0.6, -0.5, -0.3], bc_type="clamped")
    found = repair(curve, AXIS, "all_times")
    assert -1.1 < found.state(0)[0] < -1.09
    with pytest.raises(ValueError, match="start must be one of given, free"):
        repair(curve, AXIS, "all_times", start="anywhere")


def test_a_late_motion_is_repaired_as_nearly_as_one_from_the_start():
    soon, late = (
        repair(CubicSpline(np.add(X, t), [-1.0, 0.6, 0.0, 0.1], bc_type="clamped"), AXIS, "all_times")
        for t in (0.0, 1e6)
    )
    assert late.moved["position"].most <= 1.05 * soon.moved["position"].most
    assert late.state(0) == pytest.approx([-1.0, 0.0], abs=1e-6)
