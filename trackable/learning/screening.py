"""Find starting points: evaluate a grid of length scales and periods, each at its best amplitude.

The objective of a periodic kernel has a local minimum at nearly every period that samples do not exclude: a few starts
find only a few of them. But K = θ₁² C, and the eigenvalues of C serve all amplitudes θ₁: evaluating all amplitudes at
one length scale and period costs less than one step of an optimiser. Bounds are evaluated last: the best objective
without them is a lower bound of that with them, and tells which points are worth it.
"""

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from trackable.arrays import Array
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.periodic import Periodic, correlation
from trackable.gp.prior import NOISE
from trackable.gp.spectrum import Spectrum, can_be_stacked
from trackable.gp.stencil import Stencil
from trackable.gp.stencils import Stencils
from trackable.learning.constraint import Bounded
from trackable.learning.problem import ConstrainedProblem
from trackable.learning.space import SearchSpace, amplitude

_POINTS = 1200
_AMPLITUDES, _LOWEST, _HIGHEST = 48, 0.02, 5.0
_PHASES = 24
_AT_ONCE = 32  # points whose bounds are evaluated together
_NUMBERS = 2**16  # of covariance matrices that are decomposed together
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

    def least(self, points: Array) -> Array:
        """Return the objective at the best amplitude of each point, whatever the bounds: shape (b,)."""
        return np.concatenate([np.min(rays.objective, axis=1) for rays in self._rays(points)])

    def best(self, points: Array) -> tuple[Array, Array, Array]:
        """Return violations, objectives and own ln θ at the best amplitudes: shapes (b,), (b,) and (b, own p).

        The best amplitude is the likeliest of those that keep bounds.
        """
        own, learned = points[:, self.places], self.problem.prior.learned
        found = [(rays.objective, rays.margin(self.problem.constraints)) for rays in self._rays(points)]
        objective, margin = map(np.concatenate, zip(*found, strict=True))
        best = np.lexsort((objective, -margin))[:, 0]
        if "signal_std" in learned:
            own[:, learned.index("signal_std")] = np.log(self.amplitudes[best])
        every = np.arange(len(points))
        return -margin[every, best], objective[every, best], own

    def _rays(self, points: Array) -> Iterator["_Rays"]:
        (samples,) = self.problem.samples
        together = max(1, _NUMBERS // len(samples) ** 2) if can_be_stacked(samples) else 1
        for i in range(0, len(points), together):
            yield _Rays.at(self.problem, self.amplitudes, points[i : i + together, self.places])


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
    least = sum((signal.least(points) for signal in signals), np.zeros(len(points))).tolist()
    order = sorted(range(len(points)), key=lambda i: (least[i], i))
    found = dict[int, tuple[float, float, Array]]()
    inside, outside = list[tuple[float, int]](), list[tuple[float, float, int]]()
    for place, i in enumerate(order):
        while inside and inside[0] < (least[i], i):
            yield found[heapq.heappop(inside)[1]][2]
        if not is_apart(points[i]):
            continue
        if i not in found:
            following = [j for j in order[place : place + _AT_ONCE] if is_apart(points[j])]
            found.update(zip(following, _evaluated(signals, points[following]), strict=True))
        violation, objective, _ = found[i]
        if violation > 0:
            outside.append((violation, objective, i))
        else:
            heapq.heappush(inside, (objective, i))
    yield from (found[i][2] for _, i in sorted(inside))
    yield from (found[i][2] for _, _, i in sorted(outside))


def _evaluated(signals: list[_Signal], points: Array) -> Iterator[tuple[float, float, Array]]:
    """Yield violation, objective and ln θ of each point, with the best amplitude of every signal."""
    found, violation, objective = points.copy(), np.zeros(len(points)), np.zeros(len(points))
    for signal in signals:
        own_violation, own, found[:, signal.places] = signal.best(points)
        violation, objective = np.maximum(violation, own_violation), objective + own
    yield from zip(violation.tolist(), objective.tolist(), found, strict=True)


@dataclass(frozen=True)
class _Rays:
    """A signal at b points, with amplitudes θ₁ (a,) at each: `objective` l (b, a), and what its means are made of.

    `kernel` is κ/θ₁² of each point, for r of shape (…, b, ·, ·). `damped` (b, a, k) are the coefficients of the means
    along the k eigenvectors of the `spectrum`.
    """

    kernel: Callable[[Array], Array]
    period: Array
    mean: float
    stencil: Stencil | Stencils
    spectrum: Spectrum
    damped: Array
    objective: Array

    @classmethod
    def at(cls, problem: ConstrainedProblem, amplitudes: Array, points: Array) -> "_Rays":
        """Decompose the covariances at ln θ (b, p), whatever their amplitudes; those not to be stacked one by one."""
        (prior,), (samples,) = problem.prior.parts, problem.samples
        stencil, n = samples.stencil, len(samples)
        known = {name: np.full(len(points), value) for name, value in prior.hyperparameters.items()}
        theta = known | dict(zip(prior.learned, np.exp(points.T), strict=True))
        lengthscale, period, noise = theta["lengthscale"], theta["period"], theta[NOISE][:, None] ** 2
        kernel = partial(correlation, lengthscale=lengthscale[:, None, None], period=period[:, None, None])
        residual = samples.values - stencil.at_rest(prior.mean)
        if can_be_stacked(samples):
            c = Spectrum.stacked(samples, kernel, residual)
        else:
            one = Spectrum.of(samples, Periodic(1.0, lengthscale.item(), period.item()), residual)
            c = one._replace(power=one.power[None], along=one.along[None], lift=one.lift[None])
        # Eigenvalues of K + σ_n² I, one row for each amplitude; those that C does not have are σ_n².
        beside, powers = n - c.power.shape[1], amplitudes[:, None] ** 2
        spectrum = powers * np.maximum(c.power, 0)[:, None] + noise[..., None]
        objective = np.sum(np.log(spectrum) + c.along[:, None] ** 2 / spectrum, axis=2)
        objective += beside * np.log(noise) + c.rest / noise + n * np.log(2 * np.pi)
        objective += [[samples.scatter.negative_log_likelihood(each)[0]] for each in theta[NOISE].tolist()]
        return cls(kernel, period, prior.mean, stencil, c, powers * c.along[:, None] / spectrum, objective)

    def margin(self, constraints: tuple[Bounded, ...]) -> Array:
        """Return the smallest relative margin (b, a) at some phases of a period, at most 0."""
        centres = self.stencil.centres(self.spectrum.instants)
        weights = self.stencil.spread(self.damped @ self.spectrum.lift.mT).mT
        phases = np.arange(_PHASES) / _PHASES * self.period[:, None]
        margin = np.zeros(self.objective.shape)
        for constraint in constraints:
            quantity = constraint.quantity
            means = (lambda t: self.mean + self.kernel(t[..., None] - centres) @ weights,)  # one for each amplitude
            margin = np.minimum(margin, np.min(quantity.margin(means, phases), axis=1) / quantity.bounds.width)
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
