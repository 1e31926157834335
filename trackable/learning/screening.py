"""Find starting points: evaluate a grid of length scales and periods, each at its best amplitude.

The objective of a periodic kernel has a local minimum at nearly every period that samples do not exclude: a few starts
find only a few of them. But K = θ₁² C, and the eigenvalues of C serve all amplitudes θ₁: evaluating all amplitudes at
one length scale and period costs less than one step of an optimiser. Bounds are evaluated last: the best objective
without them is a lower bound of that with them, and tells which points are worth it.
"""

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.prior import NOISE
from trackable.gp.spectrum import Spectrum
from trackable.gp.stencil import Stencil
from trackable.gp.stencils import Stencils
from trackable.learning.constraint import Bounded
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
    apart = np.array([_APART.get(name.rsplit(".", 1)[-1], np.inf) for name in problem.prior.learned])
    kept: list[Array] = []

    def is_apart(point: Array) -> bool:
        return all(np.any(np.abs(point - other) > apart) for other in kept)

    for point in _by_promise(_signals(problem), problem.space.points(_POINTS), is_apart):
        if is_apart(point):
            kept.append(point)
        if len(kept) == keep:
            break
    return kept


@dataclass(frozen=True)
class _Signal:
    """One signal as a `problem` of its own, the `amplitudes` to try, and the `places` of its hyperparameters."""

    problem: ConstrainedProblem
    amplitudes: Array
    places: list[int]

    def least(self, point: Array) -> float:
        """Return the objective at the best amplitude, whatever the bounds."""
        return float(np.min(_Ray.at(self.problem, self.amplitudes, point[self.places]).objective))

    def best(self, point: Array) -> tuple[float, float, Array]:
        """Return violation, objective and own ln θ at the best amplitude: of those that keep bounds the likeliest."""
        ray, own = _Ray.at(self.problem, self.amplitudes, point[self.places]), point[self.places].copy()
        margin = ray.margin(self.problem.constraints)
        best = np.lexsort((ray.objective, -margin))[0]
        if "signal_std" in self.problem.prior.learned:
            own[self.problem.prior.learned.index("signal_std")] = np.log(self.amplitudes[best])
        return -float(margin[best]), float(ray.objective[best]), own


def _signals(problem: ConstrainedProblem) -> list[_Signal]:
    prior, bounds = problem.prior, list(problem.space.bounds.values())
    constraints = problem.constraints if len(prior.parts) == 1 else ()
    found = []
    for part, samples, places in zip(prior.parts, problem.samples, prior.places, strict=True):
        space = SearchSpace({name: bounds[place] for name, place in zip(part.learned, places, strict=True)})
        own = ConstrainedProblem((samples,), JointPrior((part,)), space, constraints)
        found.append(_Signal(own, _amplitudes(own), places))
    return found


def _by_promise(signals: list[_Signal], points: Array, is_apart: Callable[[Array], bool]) -> Iterator[Array]:
    """Yield points, each at its best amplitudes: those that keep all bounds by objective, the others by violation.

    Points that are not apart from what was kept meanwhile may be left out.
    """
    queue = [(sum(signal.least(point) for signal in signals), i, False) for i, point in enumerate(points)]
    heapq.heapify(queue)
    found, outside = dict[int, Array](), list[tuple[float, float, int]]()
    while queue:
        objective, i, is_evaluated = heapq.heappop(queue)
        if is_evaluated:
            yield found.pop(i)
        elif is_apart(points[i]):
            violation, objective, found[i] = _evaluate(signals, points[i])
            if violation > 0:
                outside.append((violation, objective, i))
            else:
                heapq.heappush(queue, (objective, i, True))
    yield from (found[i] for _, _, i in sorted(outside))


def _evaluate(signals: list[_Signal], point: Array) -> tuple[float, float, Array]:
    """Return violation, objective and ln θ, with the best amplitude of every signal."""
    found, violation, objective = point.copy(), 0.0, 0.0
    for signal in signals:
        own_violation, own, found[signal.places] = signal.best(point)
        violation, objective = max(violation, own_violation), objective + own
    return violation, objective, found


@dataclass(frozen=True)
class _Ray:
    """A signal at amplitudes θ₁ of shape (a,): its `objective` l (a,), and what its means are made of.

    `damped` (a, k) are the coefficients of the means along the k eigenvectors of the `spectrum`.
    """

    kernel: Periodic
    mean: float
    stencil: Stencil | Stencils
    spectrum: Spectrum
    damped: Array
    objective: Array

    @classmethod
    def at(cls, problem: ConstrainedProblem, amplitudes: Array, log_theta: Array) -> "_Ray":
        """Decompose the covariance at ln θ, whatever its amplitude."""
        (prior,), (samples,) = problem.prior.with_log_hyperparameters(log_theta).parts, problem.samples
        kernel = prior.kernel
        assert isinstance(kernel, Periodic)
        unit, stencil = replace(kernel, signal_std=1.0), samples.stencil
        c = Spectrum.of(samples, unit, samples.values - stencil.at_rest(prior.mean))
        # Eigenvalues of K + σ_n² I, one row for each amplitude; those that C does not have are σ_n².
        noise, beside, powers = prior.noise_std**2, len(samples) - len(c.power), amplitudes[:, None] ** 2
        spectrum = powers * np.maximum(c.power, 0) + noise
        objective = np.sum(np.log(spectrum) + c.along**2 / spectrum, axis=1)
        objective += beside * np.log(noise) + c.rest / noise + len(samples) * np.log(2 * np.pi)
        objective += samples.scatter.negative_log_likelihood(prior.noise_std)[0]
        return cls(unit, prior.mean, stencil, c, powers * c.along / spectrum, objective)

    def margin(self, constraints: tuple[Bounded, ...]) -> Array:
        """Return the smallest relative margin (a,) at some phases of a period, at most 0."""
        centres = self.stencil.centres(self.spectrum.instants)
        weights = self.stencil.spread(self.damped @ self.spectrum.lift.T).T
        phases = np.arange(_PHASES) / _PHASES * self.kernel.period
        margin = np.zeros(len(self.objective))
        for constraint in constraints:
            quantity = constraint.quantity
            means = (lambda t: self.mean + self.kernel(t[..., None] - centres) @ weights,)  # one for each amplitude
            margin = np.minimum(margin, np.min(quantity.margin(means, phases), axis=0) / quantity.bounds.width)
        return margin


def _amplitudes(problem: ConstrainedProblem) -> Array:
    """Return amplitudes around that of the samples, inside the search space; θ₁ alone where it is known."""
    (prior,), (samples,) = problem.prior.parts, problem.samples
    assert isinstance(prior.kernel, Periodic)
    if "signal_std" not in prior.learned:
        return np.array([prior.kernel.signal_std])
    scale = amplitude(samples, prior)
    bounds = problem.space.bounds["signal_std"]
    return np.clip(np.geomspace(_LOWEST * scale, _HIGHEST * scale, _AMPLITUDES), bounds.lower, bounds.upper)
