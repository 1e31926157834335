"""Periodic references are evaluated for years: against rational arithmetic, in Python, in C and in controllers."""

from fractions import Fraction
from functools import cache

import numpy as np
import pytest

from tests.trackably.exports.c_programs import CC, compiled, run
from tests.trackably.exports.certified import require_within_certified_errors
from tests.trackably.exports.references import KERNEL, SWING
from tests.trackably.plants import AXIS, SAMPLES
from trackably import (
    Periodic,
    Samples,
    learn_reference,
)
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import LATEST
from trackably.checker.certificate import AllPhases, Cover
from trackably.gp.signal import KernelSum
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference

RNG = np.random.default_rng(33)
LATE = np.unique(np.concatenate([np.round(10.0 ** RNG.uniform(3, 10, 14)), [41_900.0, 10.0**10]]))


@cache
def irregular():
    """A period that is no multiple of the sampling time, and whose binary digits do not end."""
    t = np.arange(0.0, 12.0, 0.3)
    samples = Samples(t, 0.6 * np.sin(2 * np.pi * t / 4.19))
    return learn_reference(samples, SWING, Periodic(1.0, 1.0, period=4.19), "all_phases", noise_std=0.05, starts=1)


def require_near(proved, steps, values):
    """Each value is within the certified error of the one in intervals, at the exact time without whole periods."""
    assert isinstance(proved.certificate.claim, AllPhases)
    T, period = Fraction(proved.reference.plant.sampling_time), Fraction(proved.certificate.proof.end)
    require_within_certified_errors(
        proved, (t - round(t / period) * period for t in (T * int(k) for k in steps)), values
    )


FAST = ("-O3", "-march=native", "-ffp-contract=fast")
"""Options with which a compiler contracts products and sums."""


def test_values_are_within_the_certified_error_for_years():
    proved = irregular()
    k = np.concatenate([LATE, -LATE])
    require_near(proved, k, np.hstack([proved.state(k), proved.input(k)]))
    t = proved.reference.instants(LATE)
    margins = SWING.state_set.margin(proved(t)), SWING.input_set.margin(proved.eval(t).inputs)
    assert min(map(np.min, margins)) >= 0


@pytest.mark.skipif(CC is None, reason="there is no C compiler")
def test_values_in_c_are_within_the_certified_error_for_years(tmp_path):
    proved = irregular()
    k = np.concatenate([LATE, -LATE])
    program = compiled({"reference": proved}, tmp_path, FAST)
    refused, values = run(program, "reference_step", k)
    assert not refused.any()
    require_near(proved, k, values)
    times = proved.reference.instants(k)
    refused, at = run(program, "reference_at", times)
    assert not refused.any()
    np.testing.assert_allclose(at, np.hstack([*proved.eval(times)]), atol=1e-11)


def test_steps_that_float64_cannot_count_are_refused():
    """2⁵³ + 1 is no float64: its phase would be that of another step. Of polynomial pieces as well."""
    slow = Reference((KernelSum(Periodic(1.0, 1.0, 1e6), 0.0, np.array([0.0]), np.array([0.1])),), SWING)
    pieces = Reference((PolynomialPieces([0.0, 1e5, 3e5], [[0.1, 0.0], [0.2, 0.0]], "period"),), SWING)
    for reference in (slow, pieces):
        certificate = Certificate(reference, AllPhases(), Cover(0.0, 1e6, {}, 0), {}, 1e18)
        assert certificate.first_unproved(np.array([2.0**52 * 0.1])) is None
        assert certificate.first_unproved(np.array([(2.0**53 + 2) * 0.1])) is not None


def test_what_comes_to_rest_has_no_end():
    """A periodic kernel times one that decays: the phase is lost, but nothing depends on it any more."""
    kernel = Periodic(1.0, 1.0, period=2.0) * KERNEL
    found = learn_reference(SAMPLES, AXIS, kernel, "all_times", noise_std=0.02, starts=1)
    assert found.certificate.evaluated_until == LATEST
    assert "evaluated in float64" not in found.explanation
    assert np.all(found.state(np.array([10**6, 10**12])) == found.state(10**9))
