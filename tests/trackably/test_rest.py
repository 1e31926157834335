"""References that come to rest after a finite time, exactly, by kernels with compact support; proved for all times."""

from functools import cache

import numpy as np
import pytest

from tests.trackably.plants import SCALAR
from trackably import (
    PiecewisePolynomial2,
    PiecewisePolynomial3,
    Samples,
    learn_reference,
)

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
