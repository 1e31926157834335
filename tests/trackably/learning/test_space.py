"""Search spaces: sensible defaults for every name, starts that lie inside, nothing random."""

import numpy as np
import pytest

from tests.trackably.gp.instances import REPRESENTATIVE, over
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import Stencil
from trackably.learning.space import SearchSpace, amplitude
from trackably.systems.intervals import Interval

SAMPLES = Samples([0.0, 0.5, 0.7, 2.0], [3.0, -3.0, 3.0, -3.0])


def joint(kernel, noise_std, **keywords) -> JointPrior:
    return JointPrior((Prior(kernel.as_learned(), noise_std, **keywords),))


@over(REPRESENTATIVE)
@pytest.mark.parametrize("starts", [1, 33])
def test_starts_lie_inside_and_repeat(kernel, starts):
    prior = joint(kernel, Learned(0.1))
    space = SearchSpace.around((SAMPLES,), prior, starts=starts)
    assert tuple(space.bounds) == prior.learned
    points = space.start_points()
    assert points.shape == (starts, len(space.bounds))
    assert np.all((space.log_lower < points) & (points < space.log_upper))
    assert len(np.unique(points, axis=0)) == starts
    assert points.tobytes() == space.start_points().tobytes()


def test_defaults_follow_the_scales_of_the_samples():
    prior = joint(SquaredExponential(1.0, 1.0), Learned(0.1))
    space = SearchSpace.around((SAMPLES,), prior)
    slower = SearchSpace.around((Samples(10 * SAMPLES.times, SAMPLES.values),), prior)
    louder = SearchSpace.around((Samples(SAMPLES.times, 10 * SAMPLES.values),), prior)
    np.testing.assert_allclose(np.exp(slower.log_lower - space.log_lower), [1, 10, 1])
    np.testing.assert_allclose(np.exp(louder.log_upper - space.log_upper), [10, 1, 10])
    assert space.bounds["lengthscale"].margin_of(Interval(0.2, 2.0)) >= 0  # smallest spacing, and span
    assert space.bounds["signal_std"].margin_of(Interval(0.3, 30.0)) >= 0


TWO = JointPrior(
    (Prior(SquaredExponential(1.0, 1.0), 0.1).as_learned(), Prior(SquaredExponential(1.0, 1.0).as_learned(), 0.2, 0.5)),
    ("x", "y"),
    frozenset({"lengthscale"}),
)
OTHERS = Samples([0.0, 10.0], [100.5, -99.5], stencil=Stencil((2.0,)))


def test_each_process_has_bounds_from_its_own_samples():
    """What is shared follows the first process that has it; amplitudes are those of the process, not of samples."""
    space = SearchSpace.around((SAMPLES, OTHERS), TWO)
    plain = Samples([0.0, 10.0], [50.25, -49.75])
    x, y = (SearchSpace.around((s,), JointPrior((p,))).bounds for s, p in zip((SAMPLES, plain), TWO.parts, strict=True))
    assert [*space.bounds] == ["x.signal_std", "lengthscale", "x.noise_std", "y.signal_std"]
    assert [*space.bounds.values()] == [*x.values(), y["signal_std"]]


@pytest.mark.parametrize("weights", [(-10.0, 10.0), (0.1, 0.2, -0.3), (5.0, 1e-15, -5.0)])
def test_samples_of_differences_have_a_scale(weights):
    """A difference does not see the level of the process, whatever rounding leaves of the sum of its weights."""
    samples = Samples([0.0, 0.5, 0.7, 2.0], [3.0, -3.0, 3.0, -3.0], stencil=Stencil(weights, 0.1))
    assert amplitude(samples, Prior(SquaredExponential(1.0, 1.0).as_learned(), 0.1)) == pytest.approx(3.0)
