"""Cosines and sines: they sum to the kernel, and lead to the answers of the whole matrix wherever they are offered."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from tests.trackably.gp.factors.factors import dense, disagreement, factorisations, posterior_at, with_factor
from tests.trackably.gp.instances import KERNELS, over
from trackably.gp.factors.fourier import Fourier
from trackably.gp.kernels.base import Kernel, Sum
from trackably.gp.kernels.squared_exponential import SquaredExponential

WITH_DENSITY = {name: kernel for name, kernel in KERNELS.items() if kernel.spectral_density}
TIMES = np.sort(np.random.default_rng(5).uniform(0, 6, 120))


@over(WITH_DENSITY)
def test_the_density_is_the_transform(kernel: Kernel) -> None:
    density = kernel.spectral_density
    assert density is not None
    omega = np.linspace(0, 0.4 * density.limit, 7)
    found, gradient = density.at(omega)
    by_theta = gradient * found
    for i, each in enumerate(omega):

        def integral(function, each=each):
            return 2 * quad(function, 0, density.reach, weight="cos", wvar=each, epsabs=1e-12, limit=200)[0]

        scale = found[0]
        assert found[i] == pytest.approx(integral(lambda r: kernel(np.array(r)).item()), abs=1e-9 * scale)
        for j in range(len(by_theta)):
            own = integral(lambda r, j=j: kernel.value_and_gradient(np.array(r))[1][j].item())
            assert by_theta[j, i] == pytest.approx(own, abs=1e-8 * scale)


@given(
    st.floats(0.02, 300.0),
    st.floats(0.02, 300.0),
    st.integers(60, 150),
    st.floats(0.01, 2.0),
    st.floats(0.0, 1.0),
    st.sampled_from([0.0, -3.0, 1e4]),
    st.integers(0, 2**32 - 1),
)
def test_answers_are_those_of_the_whole_matrix(lengthscale, other, count, noise, spread, first, seed):
    rng = np.random.default_rng(seed)
    times = first + np.sort(rng.uniform(0, 5, count) + rng.choice([0.0, 4.0]) * (rng.random(count) < 0.5))
    kernel = Sum(SquaredExponential(1.0, lengthscale), SquaredExponential(0.3, other))
    posterior = posterior_at(kernel, times, noise, np.exp(rng.uniform(-spread, spread, count)))
    if factor := factorisations(posterior).get(Fourier):
        assert disagreement(with_factor(posterior, factor), dense(posterior)) < 1e-8


@pytest.mark.parametrize("rungs", [-4, -2, 0, 3])
def test_the_likelihood_does_not_jump_from_one_period_to_the_next(rungs):
    density = SquaredExponential(1.0, 1.0).spectral_density
    lengthscale = (TIMES[-1] - TIMES[0]) / density.reach * 2 ** (rungs / 4)
    objectives, periods = [], []
    for factor in (1 - 1e-9, 1 + 1e-9):
        posterior = posterior_at(SquaredExponential(1.0, factor * lengthscale), TIMES, 0.1)
        found = factorisations(posterior)[Fourier]
        periods.append(found.waves.period)
        value, gradient = with_factor(posterior, found).negative_log_marginal_likelihood()
        objectives.append(value - (factor - 1) * gradient[1])
    assert periods[0] < periods[1]
    assert objectives[0] == pytest.approx(objectives[1], rel=1e-12)
