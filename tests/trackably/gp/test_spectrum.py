"""One spectrum for all amplitudes, against posteriors one by one; with few eigenvalues, and with all."""

import numpy as np
import pytest

from trackably.gp.kernels.base import Kernel, Sum
from trackably.gp.kernels.matern import Matern32
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.gp.spectrum import Spectrum
from trackably.gp.stencil import POINT, Stencil

RNG = np.random.default_rng(4)
TIMES = 100 + np.sort(RNG.uniform(0, 10, 300))
VALUES, NOISE = np.sin(TIMES) + 0.1 * RNG.standard_normal(300), np.exp(RNG.uniform(-0.5, 0.5, 300))


def scaled(kernel: Kernel, amplitude: float) -> Kernel:
    return kernel.changed(lambda name, value: amplitude if name.endswith("signal_std") else value)


@pytest.mark.parametrize("stencil", [POINT, Stencil((1.0, -0.6), 0.3, 0.2)], ids=str)
@pytest.mark.parametrize(
    ("kernel", "few"),
    [
        (Periodic(1.0, 1.0, 6.3), True),
        (Periodic(1.0, 0.7, 0.37), True),
        (Periodic(1.0, 0.7, 40.0), False),
        (Sum(Periodic(1.0, 0.7, 3.0), Periodic(1.0, 2.0, 3.0)), True),
        (Periodic(1.0, 0.05, 6.3), False),
        (SquaredExponential(1.0, 2.0), False),
        (Matern32(1.0, 2.0), False),
    ],
    ids=str,
)
@pytest.mark.parametrize("count", [40, 300])
def test_likelihood_and_mean_at_any_amplitude(kernel: Kernel, few: bool, count: int, stencil: Stencil) -> None:
    samples = Samples(TIMES[:count], VALUES[:count], NOISE[:count], stencil)
    residual = samples.values - stencil.at_rest(0.3)
    found = Spectrum.of(samples, kernel, residual)
    assert (len(found.power) < count) == (few and count == 300)
    for amplitude in (0.1, 1.0, 5.0):
        posterior = Posterior(Prior(scaled(kernel, amplitude).as_learned(), 0.2, 0.3), samples)
        spectrum, beside = amplitude**2 * found.power + 0.04, count - len(found.power)
        objective = np.sum(np.log(spectrum) + found.along**2 / spectrum) + beside * np.log(0.04) + found.rest / 0.04
        objective += 2 * np.sum(np.log(samples.relative_noise)) + count * np.log(2 * np.pi)
        assert objective == pytest.approx(posterior.negative_log_marginal_likelihood()[0], rel=1e-9)
        weights = found.lift @ (amplitude**2 * found.along / spectrum)
        mean = KernelSum(kernel, 0.3, stencil.centres(found.instants), stencil.spread(weights))
        t = np.linspace(98, 113, 200)
        np.testing.assert_allclose(mean(t), posterior.mean(t), atol=1e-8)
