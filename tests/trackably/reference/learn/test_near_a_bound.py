"""A prior mean very near to a bound, where a reference comes to rest, can still be proved."""

import numpy as np
import pytest

from tests.trackably.plants import AXIS, SAMPLES
from trackably import PiecewisePolynomial3, Samples, SquaredExponential, learn_reference


@pytest.mark.parametrize("kernel", [SquaredExponential(0.5, 0.9), PiecewisePolynomial3(0.5, 4.0)])
def test_a_millionth_of_the_width_is_enough(kernel) -> None:
    """The refusal of a mean on a bound promises it."""
    mean = 0.2 - 1.3e-6
    found = learn_reference(
        Samples(SAMPLES.times, SAMPLES.values + mean), AXIS, kernel, "all_times", noise_std=0.02, mean=mean, starts=1
    )
    np.testing.assert_allclose(found.state(10**6), [mean, 0.0], atol=1e-12)
    assert found.misfit["position"] < 0.05
