"""Which hyperparameters are learned, and the change of variables to their logarithms."""

import math

import numpy as np
import pytest

from tests.trackable.gp.instances import KERNELS, over
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.prior import Prior

KERNEL = SquaredExponential(2.0, 0.3)


@over(KERNELS)
@pytest.mark.parametrize("fixed", [frozenset(), frozenset({"noise_std"})])
def test_logarithms_make_a_round_trip(kernel, fixed):
    prior = Prior(kernel, 0.05, mean=1.0, fixed=fixed)
    names = [*kernel.hyperparameters, *({"noise_std"} - fixed)]
    assert list(prior.learned) == names
    np.testing.assert_array_equal(prior.log_hyperparameters, [math.log(prior.hyperparameters[name]) for name in names])
    moved = prior.with_log_hyperparameters(prior.log_hyperparameters + np.arange(1, len(names) + 1) / 7)
    assert (moved.mean, moved.fixed, moved.learned) == (prior.mean, prior.fixed, prior.learned)
    np.testing.assert_allclose(
        moved.log_hyperparameters - prior.log_hyperparameters, np.arange(1, len(names) + 1) / 7, rtol=1e-13
    )
    back = moved.with_log_hyperparameters(prior.log_hyperparameters)
    assert back.hyperparameters == pytest.approx(prior.hyperparameters, rel=1e-14)


def test_the_noise_is_fixed_unless_said_otherwise():
    assert Prior(KERNEL, 0.1).learned == ("signal_std", "lengthscale")
    assert Prior(KERNEL, 0.1, fixed=frozenset()).learned == ("signal_std", "lengthscale", "noise_std")


def test_what_is_fixed_stays():
    prior = Prior(KERNEL, 0.1, fixed=frozenset({"signal_std"}))
    assert prior.learned == ("lengthscale", "noise_std")
    moved = prior.with_log_hyperparameters(np.log([0.7, 0.2]))
    assert moved.hyperparameters == pytest.approx({"signal_std": 2.0, "lengthscale": 0.7, "noise_std": 0.2}, rel=1e-15)


def test_everything_may_be_fixed():
    prior = Prior(KERNEL, 0.1, fixed=frozenset({"signal_std", "lengthscale", "noise_std"}))
    assert prior.learned == ()
    assert prior.with_log_hyperparameters(prior.log_hyperparameters) == prior


def test_an_unknown_fixed_name_is_refused():
    with pytest.raises(
        ValueError, match=r"fixed names no hyperparameter period, shape; there are signal_std, lengthscale, noise_std$"
    ):
        Prior(KERNEL, 0.1, fixed=frozenset({"shape", "period", "noise_std"}))


@pytest.mark.parametrize("bad", [0.0, -0.1, math.nan, math.inf])
def test_impossible_noise_is_refused(bad):
    with pytest.raises(ValueError, match=f"^prior: noise_std must be a positive finite number, got {bad!r}$"):
        Prior(KERNEL, bad)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_an_infinite_mean_is_refused(bad):
    with pytest.raises(ValueError, match=f"^prior: mean must be finite, got {bad!r}$"):
        Prior(KERNEL, 0.1, mean=bad)


def test_logarithms_of_the_wrong_number_are_refused():
    with pytest.raises(ValueError, match="zip"):
        Prior(KERNEL, 0.1).with_log_hyperparameters(np.zeros(3))


def test_an_unknown_name_is_refused():
    with pytest.raises(TypeError, match="shape"):
        Prior(KERNEL, 0.1).with_hyperparameters({"shape": 1.0})
