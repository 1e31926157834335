"""Find starting points: evaluate a grid of length scales and periods, each at its best amplitude.

The objective of a periodic kernel has a local minimum at nearly every period that samples do not exclude, and a few
starts find only a few of them. But K = θ₁² C, and the eigenvalues of C serve all amplitudes θ₁: evaluating all
amplitudes at one length scale and period costs less than one step of an optimiser.
"""

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.prior import NOISE, Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import amplitude
from trackably.systems.trajectories import Quantities
from trackably.work import done

_POINTS = 1200  # points of the search space that are evaluated, each at all amplitudes
_AMPLITUDES, _LOWEST, _HIGHEST = 48, 0.02, 5.0  # number of amplitudes θ₁; least and largest, relative to the samples'
_PHASES = 24  # phases of a period at which bounds are evaluated
_MOST_SAMPLES, _NUMBERS = 100, 2**14  # most samples used of one signal; most entries of matrices decomposed at once
# Two starts have to differ by more than this in some ln θ, otherwise only the better one is kept.
_APART = {"lengthscale": 0.3, "period": 0.03, NOISE: 0.3}


def can_screen(prior: JointPrior) -> bool:
    """Whether all kernels are `Periodic`."""
    return all(isinstance(part.kernel, Periodic) for part in prior.parts)


def screen(problem: ConstrainedProblem, keep: int) -> list[Array]:
    """Return ln θ of up to `keep` starts, the most promising first, if all kernels are `Periodic`.

    First come points that satisfy all bounds at a few phases, sorted by objective; then the others, sorted by
    violation. Bounds are evaluated at phases of one period, whatever the index sets of the constraints are. For several
    signals, bounds are not evaluated, as one bound may depend on all signals. If a signal has many samples, only some
    are used.
    """
    points, constraints = problem.space.points(_POINTS), problem.constraints if len(problem.prior.parts) == 1 else ()
    violation, objective = np.zeros(len(points)), np.zeros(len(points))
    for part, samples, places in zip(problem.prior.parts, problem.samples, problem.prior.places, strict=True):
        few = _few(samples)
        amplitudes = _amplitudes(problem, part, samples, places)
        together = max(1, _NUMBERS // len(few) ** 2)
        for some in np.split(np.arange(len(points)), np.arange(together, len(points), together)):
            done("evaluation")
            theta = {name: np.full(len(some), float(value)) for name, value in part.hyperparameters.items()}
            theta.update(zip(part.learned, np.exp(points[some][:, places].T), strict=True))
            broken, values = _rays(part.mean, few, amplitudes, theta, constraints)
            best = np.lexsort((values, broken))[:, 0]
            at = np.arange(len(some)), best
            violation[some], objective[some] = np.maximum(violation[some], broken[at]), objective[some] + values[at]
            if "signal_std" in part.learned:
                points[some, places[part.learned.index("signal_std")]] = np.log(amplitudes[best])
    apart = np.array([_APART.get(name.rsplit(".", 1)[-1], np.inf) for name in problem.prior.learned])
    kept: list[Array] = []
    for point in points[np.lexsort((objective, violation))]:
        if len(kept) < keep and (not kept or (np.abs(point - kept) > apart).any(axis=1).all()):
            kept.append(point)
    return kept


def _rays(
    mean: float, samples: Samples, amplitudes: Array, theta: dict[str, Array], constraints: tuple[Constraint, ...]
) -> tuple[Array, Array]:
    """Return the largest relative violation of bounds at 24 phases of a period, and l, both of shape (b, a).

    There are b points of the search space and `amplitudes` (a,); each point is evaluated at each amplitude. `theta` has
    the hyperparameters at these points, each of shape (b,), and `mean` is the prior mean.
    """
    lengthscale, period, noise = theta["lengthscale"], theta["period"], theta[NOISE]
    stencil, times, relative = samples.stencil, samples.times, samples.relative_noise
    scale, rate = -2 / lengthscale[:, None, None] ** 2, np.pi / period[:, None, None]

    def kernel(r: Array) -> Array:
        return np.asarray(np.exp(scale * np.sin(rate * r) ** 2))

    centres = stencil.centres(times)
    whole = stencil.combine(stencil.combine(kernel((centres[:, None] - centres)[None])).mT)
    power, vectors = np.linalg.eigh(whole / np.outer(relative, relative))
    along = ((samples.values - stencil.at_rest(mean)) / relative) @ vectors
    powers = amplitudes[:, None] ** 2 * np.maximum(power, 0)[:, None] + noise[:, None, None] ** 2
    objective = np.sum(np.log(2 * np.pi * powers) + along[:, None] ** 2 / powers, axis=2)
    objective += [[samples.scatter.negative_log_likelihood(each)[0]] for each in noise.tolist()]
    damped = amplitudes[:, None] ** 2 * along[:, None] / powers
    weights = stencil.spread(damped @ (vectors / relative[:, None]).mT).mT
    phases = (np.arange(_PHASES) / _PHASES * period[:, None])[..., None]  # the last axis is that of the amplitudes
    broken = np.zeros(objective.shape)
    if constraints:
        means = (lambda t: mean + kernel(t - centres) @ weights,)
        margins = Quantities(tuple(of.quantity for of in constraints), means).margins(phases)
        for constraint, margin in zip(constraints, np.min(margins, axis=2), strict=True):
            broken = np.maximum(broken, -margin / constraint.quantity.bounds.width)
    return broken, objective


def _few(samples: Samples) -> Samples:
    """Return every k-th sample, with the smallest k that leaves at most `_MOST_SAMPLES`."""
    if len(samples) <= _MOST_SAMPLES:
        return samples
    return samples.only(np.arange(0, len(samples), -(-len(samples) // _MOST_SAMPLES)))


def _amplitudes(problem: ConstrainedProblem, prior: Prior, samples: Samples, places: list[int]) -> Array:
    """Return amplitudes θ₁ to try, around that of the samples and inside the search space; if θ₁ is known, only θ₁.

    `places` are the indices of the prior's learned hyperparameters in ln θ.
    """
    if "signal_std" not in prior.learned:
        return np.array([prior.hyperparameters["signal_std"]])
    scale = amplitude(samples, prior)
    bounds = list(problem.space.bounds.values())[places[prior.learned.index("signal_std")]]
    return np.clip(np.geomspace(_LOWEST * scale, _HIGHEST * scale, _AMPLITUDES), bounds.lower, bounds.upper)
