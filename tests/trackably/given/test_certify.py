"""Given trajectories are certified, refuted, or what a proof lacks is said; and the checker agrees."""

import numpy as np
import pytest
from scipy.interpolate import (
    Akima1DInterpolator,
    BPoly,
    CubicHermiteSpline,
    CubicSpline,
    PchipInterpolator,
    PPoly,
    UnivariateSpline,
    make_interp_spline,
)

from tests.trackably.plants import AXIS, CART, MIXED
from trackably import (
    CertifiedReference,
    Counterexample,
    LinearSystem,
    PolynomialPieces,
    Polytope,
    Proved,
    Refuted,
    Unproved,
    certify,
    check,
    repair,
)
from trackably import ConstrainedSystem as Plant

X, Y = [0.0, 1.0, 2.0, 3.0], [-1.0, -0.6, -0.5, 0.0]
CURVES = {
    "cubic": CubicSpline(X, Y, bc_type="clamped"),
    "pchip": PchipInterpolator(X, Y),
    "akima": Akima1DInterpolator(X, Y),
    "b-spline": make_interp_spline(X, Y, k=3),
    "smoothing": UnivariateSpline(X, Y, s=0),
    "hermite": CubicHermiteSpline(X, Y, [0.0, 0.2, 0.3, 0.0]),
    "bernstein": BPoly.from_derivatives(X, [[y, 0.1, 0.0] for y in Y]),
    "pieces": PolynomialPieces(X, np.random.default_rng(0).standard_normal((3, 4)) * 0.01, "end"),
}


@pytest.mark.parametrize("B", [[[0.005], [0.1]], [[0.0], [0.1]]])
def test_a_curve_that_jumps_is_refuted_where_it_does(B):
    """At the exact time of the worst float64 value, the jump may be over: then other times nearby are tried."""
    plant = Plant(LinearSystem([[1.0, 0.1], [0.0, 1.0]], B, sampling_time=0.1), AXIS.state_set, AXIS.input_set)
    found = certify(PPoly([[0.0, 0.0], [-1.0, 0.0]], [0.0, 1.0, 2.0]), plant)
    assert isinstance(found, Counterexample)
    assert 0.9 <= found.time <= 1.0
    assert found.violation > 3


def test_a_curve_that_repeats_keeps_its_period():
    """Any other period of the reference would drift away from the curve, and `off` would be a first period's only."""
    plant = Plant(AXIS.system, Polytope.box([-1e4, -1e4], [1e4, 1e4]), Polytope.box([-1e9], [1e9]))
    curve = CubicSpline(np.linspace(0, 0.123456, 5), [0, 1, 0, -1, 0], bc_type="periodic")
    assert certify(curve, plant).reference.pieces[0].period == 0.123456


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("claim", ["recorded", "all_times", (0.5, 2.0)])
def test_what_is_said_of_a_curve_is_so(name, claim, tmp_path):
    found = certify(CURVES[name], AXIS, claim)
    if isinstance(found, Counterexample):
        assert claim == "all_times" or name in ("hermite", "pieces"), "coming to rest takes too much force, and kinks"
        assert isinstance(check(found.save_counterexample(tmp_path / "refuted.json")), Refuted)
        return
    assert isinstance(found, CertifiedReference)
    verdict = check(*found.save_certificate(tmp_path / "proof.json"))
    assert isinstance(verdict, Proved)
    assert found.fingerprint in verdict.statement
    k = np.arange(10, 39)
    assert found.state(k + 1) == pytest.approx(AXIS.system.successor(found.state(k), found.input(k)), rel=1e-9)
    t = np.linspace(0.5, 2.0, 3001)
    apart = np.max(np.abs(found(t)[:, 0] - CURVES[name](t)))
    assert apart - 1e-14 <= found.off["position"] < 2e-3
    assert found.off["position"] <= 1.001 * apart or claim != (0.5, 2.0)


def test_several_flat_outputs_by_name():
    curves = {"b": CURVES["cubic"], "a": CubicSpline(X, Y, bc_type="clamped")}
    found = certify(curves, CART, "all_times")
    assert isinstance(found, CertifiedReference)
    assert found.off == {"a": 0.0, "b": 0.0}
    assert found(1.5) == pytest.approx(np.full(2, CURVES["cubic"](1.5)))
    assert isinstance(certify({"z1": CURVES["cubic"], "z2": CURVES["cubic"]}, MIXED), Counterexample)


def test_curves_of_different_periods_are_refused_as_no_span_of_time_shows_all_of_them():
    """Distances over one period of the first curve would be stated for all times."""
    a, b = (CubicSpline(np.linspace(0, T, 5), [0, 0.1, 0, -0.1, 0], bc_type="periodic") for T in (2.0, 1.5))
    with pytest.raises(ValueError, match=r"curves of one period, got 1\.5 s and 2 s"):
        repair({"a": a, "b": b}, CART)


def test_a_signal_that_jumps_is_proved_next_to_its_bounds():
    jumps = PPoly(np.array([[0.1, 0.9, 0.2]]), X)
    free = Plant(CART.system, CART.state_set, Polytope.box([-99, -99], [99, 99]))
    assert isinstance(certify({"a": jumps, "b": jumps}, free, (0.1, 2.5)), CertifiedReference)
    for room, kind in ((1e-15, CertifiedReference), (1e-17, Unproved), (-1e-15, Counterexample)):
        near = Plant(CART.system, Polytope.box([-1, -1], [0.9 + room * 0.9, 1]), free.input_set)
        found = certify({"a": jumps, "b": jumps}, near, (0.1, 2.5))
        assert isinstance(found, kind), room
    assert found.time == 1.0


@pytest.mark.parametrize(
    ("curve", "claim", "reason"),
    [
        (CURVES["cubic"], (0.0, 4.0), "all curves are given, from 0 s to 3 s"),
        (np.zeros(9), None, r"points are joined by a spline, as CubicSpline\(times, values\)"),
        ({"pos": CURVES["cubic"]}, None, "^trajectory: pos is neither a state"),
        (CubicSpline(X, np.zeros((4, 2))), None, "one number at each time"),
    ],
)
def test_what_does_not_fit_is_refused(curve, claim, reason):
    with pytest.raises((TypeError, ValueError), match=reason):
        certify(curve, AXIS, claim)


def test_a_jump_right_after_the_end_of_a_claim_is_no_part_of_it():
    """3.0 s is step 30 of 0.1 s, which is 2⁻⁵² s later in exact arithmetic: there the curve has jumped."""
    plant = Plant(LinearSystem([[0.0]], [[1.0]], sampling_time=0.1), Polytope.box([-2], [2]), Polytope.box([-1], [1]))
    next_to, later = (
        certify({"z1": PolynomialPieces([0.0, late, 4.0], [[0.5], [1.5]], "end")}, plant, (0.0, 3.0))
        for late in (np.nextafter(3.1, 4), 3.1 + 1e-12)
    )
    assert isinstance(next_to, Unproved)
    assert "limit at a jump is outside" in next_to.reason
    assert isinstance(later, CertifiedReference)
    assert later.input(30) == pytest.approx(np.array([0.5]))
    unproved = later.certificate.first_unproved
    assert unproved(np.array([3.0, np.nextafter(3.0, 4)])) is None
    assert unproved(np.array([3.0, 3.0 + 1e-13])) == (1, "outside of what is proved, all real t from 0 s to 3 s")
