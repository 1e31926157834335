"""References that come to rest after a finite time, exactly, by kernels with compact support; proved for all times."""

from functools import cache

import numpy as np
import pytest

from tests.trackably.checker.changes import changed
from tests.trackably.plants import SCALAR
from trackably import (
    Failed,
    PiecewisePolynomial2,
    PiecewisePolynomial3,
    Proved,
    Samples,
    check,
    learn_reference,
)
from trackably.certificates.form import encode_certificate

TIMES = np.linspace(0, 0.6, 13)
MOVED = np.where(TIMES < 0.4, -0.5 - 0.5 * np.cos(np.pi * TIMES / 0.4), 0.0)
SAMPLES = Samples(TIMES, MOVED + 0.01 * np.random.default_rng(4).standard_normal(TIMES.size))
MEANS = {"at zero": 0.0, "elsewhere": 0.0125}


@cache
def learned(family, mean):
    return learn_reference(SAMPLES, SCALAR, family(), "all_times", noise_std=0.01, mean=mean, starts=2)


@pytest.fixture(scope="module", params=[PiecewisePolynomial2, PiecewisePolynomial3], ids=lambda kernel: kernel.__name__)
def family(request):
    return request.param


@pytest.mark.parametrize("mean", MEANS.values(), ids=MEANS)
def test_the_state_is_the_prior_mean_in_every_digit(family, mean):
    found = learned(family, mean)
    (signal,) = found.reference.signals
    rests = float(signal.centres[-1]) + signal.kernel.vanishing_distance
    assert TIMES[-1] < found.certificate.proof.end <= np.nextafter(rests, np.inf)
    k = np.arange(int(np.ceil(rests / 0.01)) + 1, 20_000)
    assert set(found.state(k)[:, 0].tolist()) == {mean}
    assert np.all(found.state(k[0] - 5) != mean)
    if mean == 0:
        assert not np.any(found.input(k))
    np.testing.assert_allclose(found.input(k), 0.2 * mean, rtol=1e-12)


def test_the_checker_agrees_and_refuses_another_length_scale(family):
    content = encode_certificate(learned(family, 0.0).certificate)
    (kernel,) = (signal["kernel"] for signal in content["reference"]["signals"])
    assert kernel["type"].startswith("piecewise_polynomial")
    assert isinstance(check(content), Proved)
    for factor in (0.5, 2.0):
        other = changed(content, ("reference", "signals", 0, "kernel", "lengthscale"), factor * kernel["lengthscale"])
        assert isinstance(check(other), Failed), factor
