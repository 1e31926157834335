"""Our objective of what others hand out: J(θ, g) = l(θ) of the samples' part, and what the function costs."""

import numpy as np

from benchmarks.rivals.judge.kernels import KernelCurve
from benchmarks.rivals.model import Found, Problem
from trackably.gp.joint import JointPosterior


def objective_of(problem: Problem, found: Found) -> float | None:
    """Return J = ln|K + Σ| + n ln 2π + ‖y − S g‖²/σ² + ‖g − m‖²; None where g is not a sum of kernels of a prior.

    It is l(θ) for a posterior mean. The norm is infinite for piecewise polynomials: there is nothing to compare.
    """
    if not isinstance(found.curve, KernelCurve) or found.prior is None:
        return None
    posterior = JointPosterior(found.prior, problem.task.samples)
    total = posterior.negative_log_marginal_likelihood()[0]
    for c, (part, signal) in enumerate(zip(posterior.parts, found.curve.reference.signals, strict=True)):
        samples, prior = part.samples, part.prior
        total -= float(part.weights @ (samples.values - samples.stencil.at_rest(prior.mean)))
        off = (samples.values - found.curve.sampled(c, samples.times)) / (
            float(prior.noise_std) * samples.relative_noise
        )
        covariance = signal.kernel(signal.centres[:, None] - signal.centres)
        total += float(off @ off + signal.weights @ covariance @ signal.weights)
    return float(np.round(total, 9))
