"""Find starting points: evaluate a grid of length scales and periods, each at its best amplitude.

The objective of a periodic kernel has a local minimum at nearly every period that samples do not exclude: a few starts
find only a few of them. But K = θ₁² C, and the eigenvalues of C serve all amplitudes θ₁: evaluating all amplitudes at
one length scale and period, bounds included, costs less than one step of an optimiser.
"""

from dataclasses import replace

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.prior import NOISE
from trackable.gp.spectrum import Spectrum
from trackable.learning.problem import ConstrainedProblem
from trackable.learning.space import SearchSpace, amplitude

_POINTS = 1200
_AMPLITUDES, _LOWEST, _HIGHEST = 48, 0.02, 5.0
_PHASES = 24
# Two starts have to differ by more than this in some ln θ, otherwise only the better one is kept.
_APART = {"lengthscale": 0.3, "period": 0.03, NOISE: 0.3}


def can_screen(prior: JointPrior) -> bool:
    """Whether all kernels are `Periodic`."""
    return all(isinstance(part.kernel, Periodic) for part in prior.parts)


def screened(problem: ConstrainedProblem, keep: int) -> list[Array]:
    """Return ln θ of up to `keep` starts, the most promising first. Raises TypeError for other kernels than `Periodic`.

    First come points that keep all bounds at a few phases, sorted by objective; then the others, sorted by violation.
    Bounds are evaluated at phases of one period, whatever the index sets of the constraints are. For several signals,
    bounds are not evaluated, as one bound may depend on all of them.
    """
    if not can_screen(problem.prior):
        names = ", ".join(type(part.kernel).__name__ for part in problem.prior.parts)
        raise TypeError(f"screening needs periodic kernels, got {names}")
    signals = _signals(problem)
    evaluated = [_evaluate(signals, point) for point in problem.space.points(_POINTS)]
    apart = np.array([_APART.get(name.rsplit(".", 1)[-1], np.inf) for name in problem.prior.learned])
    kept: list[Array] = []
    for _, _, point in sorted(evaluated, key=lambda found: found[:2]):
        if len(kept) == keep:
            break
        if all(np.any(np.abs(point - other) > apart) for other in kept):
            kept.append(point)
    return kept


def _signals(problem: ConstrainedProblem) -> list[tuple[ConstrainedProblem, Array, list[int]]]:
    """Return each signal as a problem of its own, the amplitudes to try, and the indices of its hyperparameters."""
    prior, bounds = problem.prior, list(problem.space.bounds.values())
    constraints = problem.constraints if len(prior.parts) == 1 else ()
    found = []
    for part, samples, places in zip(prior.parts, problem.samples, prior.places, strict=True):
        space = SearchSpace({name: bounds[place] for name, place in zip(part.learned, places, strict=True)})
        own = ConstrainedProblem((samples,), JointPrior((part,)), space, constraints)
        found.append((own, _amplitudes(own), places))
    return found


def _evaluate(signals: list[tuple[ConstrainedProblem, Array, list[int]]], point: Array) -> tuple[float, float, Array]:
    """Return violation, objective and ln θ, with the best amplitude of every signal."""
    found, violation, objective = point.copy(), 0.0, 0.0
    for problem, amplitudes, places in signals:
        own_violation, own, found[places] = _best_amplitude(problem, amplitudes, point[places])
        violation, objective = max(violation, own_violation), objective + own
    return violation, objective, found


def _best_amplitude(problem: ConstrainedProblem, amplitudes: Array, log_theta: Array) -> tuple[float, float, Array]:
    """Return violation, objective and ln θ at the best of the amplitudes; the other hyperparameters do not change."""
    (prior,), (samples,) = problem.prior.with_log_hyperparameters(log_theta).parts, problem.samples
    kernel = prior.kernel
    assert isinstance(kernel, Periodic)
    unit = replace(kernel, signal_std=1.0)
    residual = samples.values - samples.stencil.at_rest(prior.mean)
    c = Spectrum.of(samples, unit, residual)
    # Eigenvalues of K + σ_n² I, one row for each amplitude; those that C does not have are σ_n².
    noise, beside = prior.noise_std**2, len(samples) - len(c.power)
    spectrum = amplitudes[:, None] ** 2 * np.maximum(c.power, 0) + noise
    objective = np.sum(np.log(spectrum) + c.along**2 / spectrum, axis=1)
    objective += beside * np.log(noise) + c.rest / noise + len(samples) * np.log(2 * np.pi)
    objective += samples.scatter.negative_log_likelihood(prior.noise_std)[0]
    weights = (c.lift @ (amplitudes**2 * c.along[:, None] / spectrum.T)).T
    centres, weights = samples.stencil.centres(c.instants), samples.stencil.spread(weights).T
    phases = np.arange(_PHASES) / _PHASES * kernel.period
    margin = np.zeros(len(amplitudes))
    for constraint in problem.constraints:
        quantity = constraint.quantity
        rays = (lambda t: prior.mean + unit(t[..., None] - centres) @ weights,)  # one for each amplitude
        margin = np.minimum(margin, np.min(quantity.margin(rays, phases), axis=0) / quantity.bounds.width)
    best = np.lexsort((objective, -margin))[0]
    if "signal_std" in problem.prior.learned:
        log_theta = log_theta.copy()
        log_theta[problem.prior.learned.index("signal_std")] = np.log(amplitudes[best])
    return -float(margin[best]), float(objective[best]), log_theta


def _amplitudes(problem: ConstrainedProblem) -> Array:
    """Return amplitudes around that of the samples, inside the search space; θ₁ alone where it is known."""
    (prior,), (samples,) = problem.prior.parts, problem.samples
    assert isinstance(prior.kernel, Periodic)
    if "signal_std" not in prior.learned:
        return np.array([prior.kernel.signal_std])
    scale = amplitude(samples, prior)
    bounds = problem.space.bounds["signal_std"]
    return np.clip(np.geomspace(_LOWEST * scale, _HIGHEST * scale, _AMPLITUDES), bounds.lower, bounds.upper)
