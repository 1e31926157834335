"""Fewer samples stand for all: exactly for cubics between the centres, and never for what is not resolved.

The naive second implementation interpolates between the centres, and has the matrix of all samples.
"""

import numpy as np
import pytest

from tests.trackably.gp.instances import over
from tests.trackably.gp.naive import by_log_hyperparameters
from trackably import Samples, SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.stencil import Stencil
from trackably.reference.condensed import condense, condensed_enough

RANDOM = np.random.default_rng(5)
REGULAR = np.arange(240) / 60
JITTER = np.cumsum(RANDOM.uniform(0.004, 0.03, 240))


def seen(times, **given):
    return Samples(times, np.sin(2 * times) + 0.1 * np.cos(times) * RANDOM.standard_normal(times.size), **given)


INSTANCES = {
    "regular": seen(REGULAR),
    "jitter": seen(JITTER),
    "gap": seen(np.delete(JITTER, slice(60, 170))),
    "unequal noise": seen(JITTER, relative_noise=RANDOM.uniform(0.5, 3.0, 240)),
    "far from zero": seen(1e4 + REGULAR),
    "velocities": seen(REGULAR, stencil=Stencil((-20.0, 20.0), step=0.05)),
}


CENTRES = 40
PRIOR = Prior(SquaredExponential(0.9, 0.7), 0.1, 0.2).as_learned()


def interpolation(samples, few):
    """Lagrange's polynomials of the centres in each bin, at all samples: shape (n, m)."""
    ends = np.linspace(samples.times[0], samples.times[-1], CENTRES // 4 + 1)[1:-1]
    of, own = (np.searchsorted(ends, t, side="right") for t in (samples.times, few.times))
    H = np.zeros((len(samples), len(few)))
    for a, tau in enumerate(few.times):
        others = few.times[(own == own[a]) & (few.times != tau)]
        here = of == own[a]
        H[here, a] = np.prod((samples.times[here, None] - others) / (tau - others), axis=1)
    return H


def naive_likelihood(prior, samples, few):
    """−2 ln p of all samples, of a signal that is a cubic between the centres."""
    H = interpolation(samples, few)
    A = H @ few.covariance(prior.kernel)[0] @ H.T + np.diag((prior.noise_std * samples.relative_noise) ** 2)
    off = samples.values - samples.stencil.at_rest(prior.mean)
    return np.linalg.slogdet(2 * np.pi * A)[1] + off @ np.linalg.solve(A, off)


@over(INSTANCES, "samples")
def test_likelihood_against_the_naive_one_and_its_gradient_against_differences(samples):
    few = condense(samples, CENTRES)
    value, gradient = Posterior(PRIOR, few).negative_log_marginal_likelihood()
    assert value == pytest.approx(naive_likelihood(PRIOR, samples, few), rel=1e-8)
    slopes = by_log_hyperparameters(lambda prior: Posterior(prior, few).negative_log_marginal_likelihood()[0], PRIOR)
    np.testing.assert_allclose(gradient, slopes, rtol=1e-4, atol=1e-3)


def test_an_automatic_number_resolves_what_few_centres_do_not():
    """With 64 centres and with 128, 40 cycles are lost alike: it would not do to begin with few."""
    times = np.arange(4000) / 50
    fast = Samples(times, np.sin(np.pi * times) + 0.1 * np.random.default_rng(1).standard_normal(times.size))
    few = condensed_enough(fast)
    assert 4 * 40 < len(few) <= 1000
    assert few.scatter.squares / few.scatter.count == pytest.approx(0.01, rel=0.1)
