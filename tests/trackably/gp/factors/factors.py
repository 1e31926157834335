"""All factorisations of a covariance matrix, by type, and the largest difference of two posteriors."""

import numpy as np

from trackably.gp.factorise import candidates
from trackably.gp.factors.factorisation import Factorisation
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT


def posterior_at(kernel, times, noise, relative_noise=None, stencil=POINT):
    """A posterior given samples of a noisy sine; `noise` is relative to the kernel's standard deviation."""
    scale = float(kernel(np.zeros(()))) ** 0.5
    rng = np.random.default_rng(len(times))
    clean = np.sin(times - times[0]) + 0.3 + noise * rng.standard_normal(len(times))
    spread = np.ones(len(times)) if relative_noise is None else relative_noise
    samples = Samples(times, clean * scale, spread, stencil)
    return Posterior(Prior(kernel, noise * scale, 0.1).as_learned(), samples)


def factorisations(posterior: Posterior) -> dict[type[Factorisation], Factorisation]:
    """All factorisations that are offered and succeed, by type."""
    computed = candidates(posterior.prior, posterior.samples)
    return {type(factor): factor for factor in computed if factor is not None}


def with_factor(posterior: Posterior, factor: Factorisation | None) -> Posterior:
    """The same posterior by another factorisation."""
    other = Posterior(posterior.prior, posterior.samples)
    vars(other)["_factored"] = factor
    return other


def disagreement(one: Posterior, other: Posterior) -> float:
    """The largest relative difference of likelihood, gradients, weights, means, their derivatives and variances."""
    first, span = one.samples.times[0], one.samples.times[-1] - one.samples.times[0]
    t = first + np.linspace(-0.1 * span, 1.2 * span, 60)

    def answers(p):
        jets = p.jets(t, 0)
        derived = jets[0] - p.prior.mean, jets[1:], p.signal.derivative(t), p.variance_of(np.ones(1), 0.0, t)
        return *p.negative_log_marginal_likelihood(), p.weights, *derived

    return max(np.max(np.abs(a - b)) / np.max(np.abs(b)) for a, b in zip(answers(one), answers(other), strict=True))
