"""Find starting points: evaluate a grid of length scales and periods, each at its best amplitude.

The objective of a periodic kernel has a local minimum at nearly every period that samples do not exclude, and a few
starts find only a few of them. But K = θ₁² C, and the eigenvalues of C serve all amplitudes θ₁: evaluating all
amplitudes at one length scale and period costs less than one step of an optimiser. Bounds are evaluated last, because
the best objective without bounds is a lower bound of that with bounds, and shows which points are worth it.
"""

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic, correlation
from trackably.gp.prior import NOISE
from trackably.gp.samples import Samples
from trackably.gp.spectrum import Spectrum, can_be_stacked
from trackably.learning.constraint import Bounded
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace, amplitude
from trackably.progress.work import done

_POINTS = 1200
_AMPLITUDES, _LOWEST, _HIGHEST = 48, 0.02, 5.0
_PHASES = 24
_AT_ONCE = 32  # points whose bounds are evaluated together
_NUMBERS, _KEPT = 2**14, 2**22  # of covariance matrices that are decomposed together, and of all that are kept
# Two starts have to differ by more than this in some ln θ, otherwise only the better one is kept.
_APART = {"lengthscale": 0.3, "period": 0.03, NOISE: 0.3}


def can_screen(prior: JointPrior) -> bool:
    """Whether all kernels are `Periodic`."""
    return all(isinstance(part.kernel, Periodic) for part in prior.parts)


def screened(problem: ConstrainedProblem, keep: int) -> list[Array]:
    """Return ln θ of up to `keep` starts, the most promising first. Raises TypeError for other kernels than `Periodic`.

    Points that keep all bounds at a few phases come first, sorted by objective; then the others, sorted by violation.
    Bounds are evaluated at phases of one period, whatever the index sets of the constraints are. With several signals
    bounds are not evaluated, as one bound may depend on all of them.
    """
    if not can_screen(problem.prior):
        names = ", ".join(type(part.kernel).__name__ for part in problem.prior.parts)
        raise TypeError(f"screening needs periodic kernels, got {names}")
    apart = np.array([_APART.get(name.rsplit(".", 1)[-1], np.inf) for name in problem.prior.learned])
    kept: list[Array] = []

    def is_apart(point: Array) -> bool:
        return not kept or bool((np.abs(point - kept) > apart).any(axis=1).all())

    points = problem.space.points(_POINTS)
    for point in _by_promise(_signals(problem, points), points, is_apart):
        if is_apart(point):
            kept.append(point)
        if len(kept) == keep:
            break
    return kept


@dataclass(frozen=True, eq=False)
class _Signal:
    """One signal as a `problem` of its own, at `points` (b, own p) and with `amplitudes` to try at each.

    `places` are the indices of its hyperparameters among those of all signals.
    """

    problem: ConstrainedProblem
    points: Array
    amplitudes: Array
    places: list[int]

    def least(self) -> Array:
        """Return the least objective over all amplitudes at each point, without bounds: shape (b,)."""
        every = [self._known] if self._known else self._rays(self.points)
        return np.concatenate([np.min(rays.objective, axis=1) for rays in every])

    def best(self, chosen: list[int]) -> tuple[Array, Array, Array]:
        """Return violations, objectives and own ln θ at the best amplitudes: shapes (c,), (c,) and (c, own p).

        The best amplitude is the likeliest of those that keep the bounds, or that with the least violation.
        """
        own, learned = self.points[chosen], self.problem.prior.learned
        some = [self._known.among(chosen)] if self._known else self._rays(own)
        found = [(rays.objective, rays.margin(self.problem.constraints)) for rays in some]
        objective, margin = map(np.concatenate, zip(*found, strict=True))
        best = np.lexsort((objective, -margin))[:, 0]
        if "signal_std" in learned:
            own[:, learned.index("signal_std")] = np.log(self.amplitudes[best])
        at = np.arange(len(own)), best
        return -margin[at], objective[at], own

    @cached_property
    def _known(self) -> "_Rays | None":
        """The decompositions at all points, if they fit into memory; otherwise None."""
        (samples,) = self.problem.samples
        fits = can_be_stacked(samples) and len(self.points) * len(samples) ** 2 <= _KEPT
        return _Rays.joined(list(self._rays(self.points))) if fits else None

    def _rays(self, points: Array) -> Iterator["_Rays"]:
        (samples,) = self.problem.samples
        together = max(1, _NUMBERS // len(samples) ** 2) if can_be_stacked(samples) else 1
        for i in range(0, len(points), together):
            done("evaluation")
            yield _Rays.at(self.problem, self.amplitudes, points[i : i + together])


def _signals(problem: ConstrainedProblem, points: Array) -> list[_Signal]:
    prior, bounds = problem.prior, list(problem.space.bounds.values())
    constraints = problem.constraints if len(prior.parts) == 1 else ()
    found = []
    for part, samples, places in zip(prior.parts, problem.samples, prior.places, strict=True):
        space = SearchSpace({name: bounds[place] for name, place in zip(part.learned, places, strict=True)})
        own = ConstrainedProblem((samples,), JointPrior((part,)), space, constraints)
        found.append(_Signal(own, points[:, places], _amplitudes(own), places))
    return found


def _by_promise(signals: list[_Signal], points: Array, is_apart: Callable[[Array], bool]) -> Iterator[Array]:
    """Yield points at their best amplitudes: feasible ones sorted by objective, then the others sorted by violation.

    Points too close to one that was kept in the meantime may be left out.
    """
    least = sum((signal.least() for signal in signals), np.zeros(len(points))).tolist()
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
            found.update(zip(following, _evaluated(signals, points, following), strict=True))
        violation, objective, _ = found[i]
        if violation > 0:
            outside.append((violation, objective, i))
        else:
            heapq.heappush(inside, (objective, i))
    yield from (found[i][2] for _, i in sorted(inside))
    yield from (found[i][2] for _, _, i in sorted(outside))


def _evaluated(signals: list[_Signal], points: Array, chosen: list[int]) -> Iterator[tuple[float, float, Array]]:
    """Yield violation, objective and ln θ of each chosen point, with the best amplitude of every signal."""
    found, violation, objective = points[chosen], np.zeros(len(chosen)), np.zeros(len(chosen))
    for signal in signals:
        own_violation, own, found[:, signal.places] = signal.best(chosen)
        violation, objective = np.maximum(violation, own_violation), objective + own
    yield from zip(violation.tolist(), objective.tolist(), found, strict=True)


@dataclass(frozen=True)
class _Rays:
    """A signal at b points: κ/θ₁² with these length scales and periods (b,), and noise variances σ_n² (b, 1).

    `spectrum` holds eigenvalues and eigenvectors of C; `objective` is l at each of the amplitudes θ₁ (a,): shape (b,
    a).
    """

    samples: Samples
    mean: float
    amplitudes: Array
    lengthscale: Array
    period: Array
    noise: Array
    spectrum: Spectrum
    objective: Array

    @classmethod
    def at(cls, problem: ConstrainedProblem, amplitudes: Array, points: Array) -> "_Rays":
        """Decompose the covariances at ln θ (b, p) for all amplitudes; one by one if samples cannot be stacked."""
        (prior,), (samples,), n = problem.prior.parts, problem.samples, len(problem.samples[0])
        known = {name: np.full(len(points), value) for name, value in prior.hyperparameters.items()}
        theta = known | dict(zip(prior.learned, np.exp(points.T), strict=True))
        lengthscale, period, noise = theta["lengthscale"], theta["period"], theta[NOISE][:, None] ** 2
        residual = samples.values - samples.stencil.at_rest(prior.mean)
        if can_be_stacked(samples):
            c = Spectrum.stacked(samples, _kernel(lengthscale, period), residual)
        else:
            one = Spectrum.of(samples, Periodic(1.0, lengthscale.item(), period.item()), residual)
            c = one._replace(power=one.power[None], along=one.along[None], lift=one.lift[None])
        powers = _powers(c, amplitudes, noise)  # those that C does not have are σ_n²
        objective = np.sum(np.log(powers) + c.along[:, None] ** 2 / powers, axis=2)
        objective += (n - c.power.shape[1]) * np.log(noise) + c.rest / noise + n * np.log(2 * np.pi)
        objective += [[samples.scatter.negative_log_likelihood(each)[0]] for each in theta[NOISE].tolist()]
        return cls(samples, prior.mean, amplitudes, lengthscale, period, noise, c, objective)

    @classmethod
    def joined(cls, parts: list["_Rays"]) -> "_Rays":
        """Join the results at several groups of points, for samples that `can_be_stacked`."""
        return parts[0]._with(
            [np.concatenate(arrays) for arrays in zip(*(part._of_points for part in parts), strict=True)]
        )

    def among(self, chosen: list[int]) -> "_Rays":
        """Return the results at the chosen points."""
        return self._with([array[chosen] for array in self._of_points])

    @property
    def _of_points(self) -> list[Array]:
        """All arrays whose first axis counts the points."""
        c = self.spectrum
        return [self.lengthscale, self.period, self.noise, self.objective, c.power, c.along, c.lift]

    def _with(self, of_points: list[Array]) -> "_Rays":
        lengthscale, period, noise, objective, power, along, lift = of_points
        spectrum = self.spectrum._replace(power=power, along=along, lift=lift)
        return replace(
            self, lengthscale=lengthscale, period=period, noise=noise, objective=objective, spectrum=spectrum
        )

    def margin(self, constraints: tuple[Bounded, ...]) -> Array:
        """Return the smallest relative margin (b, a) at some phases of a period, but at most 0."""
        c, stencil, kernel = self.spectrum, self.samples.stencil, _kernel(self.lengthscale, self.period)
        # Coefficients (b, a, k) of the means along the k eigenvectors.
        damped = self.amplitudes[:, None] ** 2 * c.along[:, None] / _powers(c, self.amplitudes, self.noise)
        centres, weights = stencil.centres(c.instants), stencil.spread(damped @ c.lift.mT).mT
        phases = np.arange(_PHASES) / _PHASES * self.period[:, None]
        margin = np.zeros(self.objective.shape)
        for constraint in constraints:
            quantity = constraint.quantity
            means = (lambda t: self.mean + kernel(t[..., None] - centres) @ weights,)  # one for each amplitude
            margin = np.minimum(margin, np.min(quantity.margin(means, phases), axis=1) / quantity.bounds.width)
        return margin


def _kernel(lengthscale: Array, period: Array) -> Callable[[Array], Array]:
    """Return κ/θ₁² of each point, for r of shape (…, b, ·, ·)."""
    return partial(correlation, lengthscale=lengthscale[:, None, None], period=period[:, None, None])


def _powers(c: Spectrum, amplitudes: Array, noise: Array) -> Array:
    """Return the eigenvalues of θ₁² C + σ_n² I, one row for each amplitude: shape (b, a, k)."""
    return np.asarray(amplitudes[:, None] ** 2 * np.maximum(c.power, 0)[:, None] + noise[..., None])


def _amplitudes(problem: ConstrainedProblem) -> Array:
    """Return amplitudes θ₁ around that of the samples, inside the search space; the known one if θ₁ is known."""
    (prior,), (samples,) = problem.prior.parts, problem.samples
    assert isinstance(prior.kernel, Periodic)
    if "signal_std" not in prior.learned:
        return np.array([prior.kernel.signal_std])
    scale = amplitude(samples, prior)
    bounds = problem.space.bounds["signal_std"]
    return np.clip(np.geomspace(_LOWEST * scale, _HIGHEST * scale, _AMPLITUDES), bounds.lower, bounds.upper)
