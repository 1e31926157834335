"""Which hyperparameters are learned, and the change of variables to their logarithms."""

import math

import numpy as np
import pytest

from tests.trackably.gp.instances import REPRESENTATIVE, over
from trackably.gp.hyperparameter import Learned
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior

KERNEL = SquaredExponential(2.0, 0.3)


@over(REPRESENTATIVE)
@pytest.mark.parametrize("noise_std", [0.05, Learned(0.05), Learned(0.05, (0.01, 0.1))])
def test_logarithms_make_a_round_trip(kernel, noise_std):
    prior = Prior(kernel.as_learned(), noise_std, mean=1.0)
    names = [*kernel.hyperparameters, *(["noise_std"] if isinstance(noise_std, Learned) else [])]
    assert list(prior.learned) == names
    np.testing.assert_array_equal(prior.log_hyperparameters, [math.log(prior.hyperparameters[name]) for name in names])
    moved = prior.with_log_hyperparameters(prior.log_hyperparameters + np.arange(1, len(names) + 1) / 7)
    assert (moved.mean, moved.learned, intervals(moved)) == (prior.mean, prior.learned, intervals(prior))
    np.testing.assert_allclose(
        moved.log_hyperparameters - prior.log_hyperparameters, np.arange(1, len(names) + 1) / 7, rtol=1e-13
    )
    back = moved.with_log_hyperparameters(prior.log_hyperparameters)
    assert back.hyperparameters == pytest.approx(prior.hyperparameters, rel=1e-14)


def intervals(prior):
    return [value.interval for value in prior.hyperparameters.values() if isinstance(value, Learned)]


@pytest.mark.parametrize("bad", [0.0, -0.1, math.nan, math.inf])
def test_impossible_noise_is_refused(bad):
    with pytest.raises(ValueError, match=rf"^Prior: noise_std must be a positive number \(known\) or .*, got {bad!r}$"):
        Prior(KERNEL.as_learned(), bad)
