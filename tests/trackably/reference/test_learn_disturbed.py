"""References learned for a disturbed system, or with a margin: what is said, kept, and stored."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from tests.trackably.saved import assert_comes_back
from trackably import (
    ConvexHull,
    Proved,
    SquaredExponential,
    Zonotope,
    check,
    learn_reference,
)
from trackably.certificates.form import encode_certificate

KERNEL = SquaredExponential(0.5, 0.5)
PUSHED = Zonotope.box([0.0, -0.005], [0.0, 0.005])
NOISE = Zonotope.box([-0.001, -0.002], [0.001, 0.002])
ARGUMENTS = {"noise_std": 0.02, "starts": 1}
WINDOW = (0.0, 3.0)


@cache
def learned(name):
    extra = {
        "nominal": {},
        "without disturbance": {"disturbance": Zonotope.box([0.0, 0.0], [0.0, 0.0])},
        "pushed": {"disturbance": PUSHED},
        "triangle": {"disturbance": ConvexHull([[0.004, 0.0], [-0.004, 0.004], [0.0, -0.004]]), "margin": 0.02},
        "margin": {"margin": 0.05},
        "noisy": {"disturbance": PUSHED, "measurement_noise": NOISE},
        "hyperparameters": {"disturbance": PUSHED, "method": "hyperparameters"},
    }[name]
    kernel = SquaredExponential() if name == "hyperparameters" else KERNEL
    return learn_reference(SAMPLES, AXIS, kernel, WINDOW, **ARGUMENTS, **extra)


@pytest.mark.parametrize("name", ["pushed", "triangle", "hyperparameters"])
def test_a_robust_reference_keeps_the_tightened_bounds_and_says_so(name):
    found = learned(name)
    Z, steps = found.tightening.invariant, np.arange(61)
    assert found.certificate.robust.invariant is Z
    for bounded, rows, values in (
        (AXIS.state_set, np.eye(2), found.state(steps)),
        (AXIS.input_set, Z.feedback, found.input(steps[:-1])),
    ):
        for row, lower, upper, of_row in zip(rows.tolist(), bounded.lower, bounded.upper, values.T, strict=True):
            assert np.max(of_row) <= upper - float(Fraction(*Z.support([Fraction(r) for r in row])))
            assert np.min(of_row) >= lower + float(Fraction(*Z.support([-Fraction(r) for r in row])))
    verdict = check(encode_certificate(found.certificate))
    assert isinstance(verdict, Proved)
    assert "for every sequence of w in W" in verdict.statement
    assert f"under every disturbance in {Z.disturbance}" in found.explanation


@pytest.mark.parametrize("name", ["triangle", "noisy"])
def test_disturbed_runs_keep_the_given_bounds(name):
    """Greedy against each bound: u = u_r + K (x + v − x_r), for the window that is proved."""
    found = learned(name)
    Z, system, rng = found.tightening.invariant, AXIS.system, np.random.default_rng(0)
    pushes = PUSHED if name == "noisy" else Z.disturbance
    aims = [*np.vstack([np.eye(2), -np.eye(2), Z.feedback, -Z.feedback]), *rng.normal(size=(4, 2))]
    for aim in aims:
        x = found.state(0) + np.zeros(2)
        for k in range(60):
            v = NOISE.farthest(aim if k % 2 else -aim) if name == "noisy" else 0.0
            u = found.input(k) + Z.feedback @ (x + v - found.state(k))
            assert AXIS.input_set.margin(u) >= 0
            x = system.successor(x, u) + pushes.farthest(aim)
            assert AXIS.state_set.margin(x) >= 0


def test_without_disturbance_the_nominal_reference_comes_back():
    nominal, same = learned("nominal"), learned("without disturbance")
    assert same.objective == nominal.objective
    for one, other in zip(nominal.reference.signals, same.reference.signals, strict=True):
        assert np.array_equal(one.weights, other.weights)
    assert same.certificate.proof == nominal.certificate.proof


def test_a_margin_is_kept_free():
    found = learned("margin")
    values = found.state(np.arange(61))
    assert np.all(values <= AXIS.state_set.upper - 0.05 * np.array([1.3, 2.0]))
    assert "0.05 of each width is kept free at either bound" in found.explanation
    assert found.certificate.robust is None


@pytest.mark.parametrize("name", ["triangle", "noisy"])
def test_what_is_saved_comes_back(name, tmp_path):
    assert_comes_back(learned(name), tmp_path)
