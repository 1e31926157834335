"""Learn prior means, noise and kernel hyperparameters from samples, before any bounds are considered."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from reprlib import repr as short
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from trackably.arguments import is_number
from trackably.arrays import Array
from trackably.certificates.certified import Certified
from trackably.certificates.judge import found_or_raise
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.posterior import Posterior
from trackably.gp.prior import NOISE
from trackably.gp.samples import ResidualStatistics, Samples
from trackably.learning import sqp
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.reference.fit import edges_of, narrow_limits
from trackably.systems.trajectories import Quantity

T = TypeVar("T")

Mean = float | tuple[float, float] | None
"""A prior mean in the unit of the samples: known, learned between two values, or learned without limits (None)."""

Ends = tuple[tuple[float, float] | None, ...]
"""For each flat output, the interval in which its prior mean is learned; None if the mean is known."""

Indices = npt.NDArray[np.intp]

_ANYWHERE = (-inf, inf)
_NO_EVIDENCE = 1.0  # if J exceeds the least −2 ln p without bounds by less than this, noise is not learned again
_SEEN = 10.0  # a learned σ_n counts as noise, and is held, only above this many times the lower end of its interval
_ROOM = 1e-2, 1e-4, 1e-6  # slacks of learned means at bounds, as parts of a width: tried in turn until one is possible
_FAR_LIKELIER = 10.0  # another kernel is preferred if its −2 ln p is lower by more than this: odds of about 150 to 1
# Samples count as noise alone if the kernel lowers −2 ln p by less than this: 2 for each of its two hyperparameters, as
# in Akaike's criterion.
_AS_LIKELY = 4.0
_UNRELATED = 0.2  # neighbouring samples whose prior correlation is at most this count as unrelated
_FEWEST = 10  # fewer samples than this are never taken for noise alone, as they may be waypoints


@dataclass(frozen=True)
class EmpiricalPrior:
    """The `prior` for learning with bounds, and `questions`: texts of warnings, for example about narrow intervals.

    `likeliest` is the posterior without bounds from which means and noise were taken; None if all were given.
    In `prior`, a learned σ_n may be taken as known; `with_noise` is then the prior in which it is learned again, else
    None. `minima` are ln θ by name at the local minima of l for these means, best first; empty if they are not known.
    """

    prior: JointPrior
    questions: tuple[str, ...] = ()
    likeliest: JointPosterior | None = None
    with_noise: JointPrior | None = None
    minima: tuple[Mapping[str, float], ...] = ()

    @property
    def likely(self) -> JointPrior:
        """The prior with the likeliest hyperparameters, all known; the `prior` itself if they were not learned."""
        if self.likeliest is None:
            return self.prior
        return _with_means(self.likeliest.prior, [part.mean for part in self.prior.parts]).as_known()

    def best(self, learn: Callable[[JointPrior], T]) -> T:
        """Return the result of `learn` for `prior`, or for `with_noise` if the objective J is smaller there.

        Minimising J over σ_n too would always lower it. So `with_noise`, in which σ_n is learned again, is tried only
        in two cases: `prior` leads to no solution; or only hyperparameters were learned, and J is well above l, which
        is −2 ln p of the samples without bounds.
        """
        found = learn(self.prior)
        first = _solution_of(found)
        if self.with_noise is None or (first and first.method == "joint"):
            return found
        assert self.likeliest, "noise was learned from it"
        if first and first.objective - self.likeliest.negative_log_marginal_likelihood()[0] < _NO_EVIDENCE:
            return found
        other = learn(self.with_noise)
        second = _solution_of(other)
        return other if second and (first is None or second.objective < first.objective) else found


def _solution_of(found: object) -> Solution | None:
    solution = found.solution if isinstance(found, Certified) else found
    return solution if isinstance(solution, Solution) else None


def empirical_prior(
    samples: tuple[Samples, ...],
    prior: JointPrior,
    between: Ends,
    starts: int,
    keep: bool,
    hold_noise: bool = False,
    at_rest: Sequence[Quantity] = (),
) -> EmpiricalPrior:
    """Learn means, noise and hyperparameters from samples by maximum likelihood, without bounds.

    With `keep`, all of them are known in the returned prior; otherwise hyperparameters are learned again later, under
    the bounds. Only means with an interval in `between` are learned here. With `hold_noise`, each σ_n without an
    interval of its own is learned here and then known, because misfits that bounds cause are not sensor noise; if the
    samples show no noise, σ_n is learned again later. Means without limits are chosen so that the quantities `at_rest`
    keep their bounds. NotTrackableError: the likelihood of the samples cannot be evaluated.
    """
    noises = [part.noise_std for part in prior.parts]
    left_out = [hold_noise and isinstance(noise, Learned) and noise.interval is None for noise in noises]
    if not (keep or any(between) or any(left_out)):
        return EmpiricalPrior(prior)
    found = found_or_raise(_without_bounds(samples, prior, between, starts))
    likeliest = found.posterior.prior
    questions = [
        f"mean: the learned mean of {name} lies at an end of its given interval: widen it, unless this is a limit"
        for name, part, ends in zip(prior.names, likeliest.parts, between, strict=True)
        if ends and part.mean in ends
    ]
    if likelier := [] if keep else [*_likelier(found.posterior, prior, between, left_out, starts)]:
        held = {name: noise_std for name, noise_std, _ in likelier}
        own = zip(prior.names, prior.parts, strict=True)
        holding = prior.with_parts(replace(part, noise_std=held.get(name, part.noise_std)) for name, part in own)
        found = found_or_raise(_without_bounds(samples, holding, between, starts))
        likeliest, questions = found.posterior.prior, [*questions, *(question for _, _, question in likelier)]
    means = _admissible(at_rest, found.posterior, [ends == _ANYWHERE for ends in between])
    if keep:
        questions += narrow_limits(edges_of(likeliest, samples))
        return EmpiricalPrior(_with_means(likeliest, means).as_known(), tuple(questions))
    with_noise = _with_means(prior, means)
    bounds = SearchSpace.around(samples, prior, starts).bounds
    least = [bounds[name].lower if (name := prior.name_of(of, NOISE)) in bounds else 0 for of in prior.names]
    parts = zip(with_noise.parts, likeliest.parts, left_out, least, strict=True)
    known = tuple(
        replace(own, noise_std=float(of.noise_std)) if may and of.noise_std > _SEEN * low else own
        for own, of, may, low in parts
    )
    minima = (likeliest.log_hyperparameters, *found.others) if means == [part.mean for part in likeliest.parts] else ()
    return EmpiricalPrior(
        prior.with_parts(known),
        tuple(questions),
        found.posterior,
        with_noise if known != with_noise.parts else None,
        tuple(dict(zip(likeliest.learned, theta.tolist(), strict=True)) for theta in minima),
    )


def _likelier(
    likeliest: JointPosterior, prior: JointPrior, between: Ends, left_out: Sequence[bool], starts: int
) -> Iterator[tuple[str, float, str]]:
    """Yield the name, a likelier σ_n and a warning's text if a kernel takes motion for noise, or noise for motion.

    Only names whose σ_n the user left out (`left_out`) are examined, and only samples that are not all equal.
    """
    parts = zip(prior.names, prior.parts, likeliest.parts, between, left_out, strict=True)
    for name, part, posterior, ends, may in parts:
        if not may or not np.ptp(posterior.samples.values):
            continue
        if noise_std := _noise_alone(posterior):
            other = "kernel" if part.kernel.period is None else "period"
            question = (
                f"samples: those of {name} look like noise to this kernel: σ_n = {noise_std:.4g} is learned; if they "
                f"show a motion, give its noise_std, or another {other}"
            )
            yield name, noise_std, question
        elif isinstance(part.kernel, SquaredExponential) and _go_on(posterior):
            found = _without_bounds(
                (posterior.samples,), JointPrior((replace(part, kernel=Matern52()),)), (ends,), starts
            )
            if not isinstance(found, Solution):
                continue
            gain = posterior.negative_log_marginal_likelihood()[0] - found.objective
            if gain > _FAR_LIKELIER:
                noise_std = float(found.posterior.prior.parts[0].noise_std)
                question = (
                    f"kernel: Matern52() explains the samples of {name} far better than SquaredExponential() does "
                    f"(−2 ln p is {gain:.3g} less): σ_n = {noise_std:.4g} is learned with it, as the smoother kernel "
                    "takes motion for noise"
                )
                yield name, noise_std, question


def _without_bounds(samples: tuple[Samples, ...], prior: JointPrior, means: Ends, starts: int) -> Solution | NoSolution:
    """Learn hyperparameters, and the means with an interval in `means`, by maximum likelihood without bounds."""
    return best_solution(ConstrainedProblem(samples, prior, SearchSpace.around(samples, prior, starts), means=means))


def _noise_alone(posterior: Posterior) -> float | None:
    """Return σ_n if the samples may just as well be noise around the prior mean; None if a motion is likelier.

    A kernel with a length scale below the spacing of samples explains noise as motion, so that the likelihood alone
    does not tell noise from motion.
    """
    samples, prior = posterior.samples, posterior.prior
    spacings = np.diff(np.unique(samples.times))
    if len(samples) < _FEWEST or not len(spacings):
        return None
    near, same = prior.kernel(np.array([np.median(spacings), 0.0])).tolist()
    if near > _UNRELATED * same:
        return None
    off = (samples.values - samples.stencil.at_rest(prior.mean)) / samples.relative_noise
    alone = samples.scatter + ResidualStatistics(
        len(off), float(off @ off), float(np.sum(np.log(samples.relative_variance)))
    )
    noise_std = float(np.sqrt(alone.squares / alone.count))
    if not noise_std:
        return None
    worse = alone.negative_log_likelihood(noise_std)[0] - posterior.negative_log_likelihood
    return noise_std if worse < _AS_LIKELY else None


def _go_on(posterior: Posterior) -> bool:
    """Whether successive residuals of the posterior mean are positively correlated, more than by chance.

    Residuals of a suitable kernel are negatively correlated, because the posterior mean follows each sample a little.
    """
    residuals = posterior.weights * posterior.samples.relative_noise  # each in units of its noise
    along = float(residuals[1:] @ residuals[:-1])
    return along * float(np.sqrt(len(residuals))) > float(residuals @ residuals)


def split_means(
    mean: Mean | Mapping[str, Mean], names: tuple[str, ...], samples: Mapping[str, Samples]
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Return a first prior mean for each name, and the intervals of the means that are to be learned.

    A mean given as None is learned without limits; it is first the average of the `samples` of its name. A mean given
    as a pair is learned in this interval; it is first the middle. ValueError: an interval is invalid.
    """
    given = mean if isinstance(mean, Mapping) else dict.fromkeys(names, mean)
    known, between = dict[str, float](), dict[str, tuple[float, float]]()
    for name, one in given.items():
        if one is None:
            known[name] = float(np.mean(samples[name].values)) if name in samples else 0.0
            between[name] = _ANYWHERE
        elif isinstance(one, tuple | list):
            between[name] = _interval(name, one)
            known[name] = sum(between[name]) / 2
        else:
            known[name] = one
    return known, between


def levels(between: Mapping[str, tuple[float, float]], names: tuple[str, ...], samples: tuple[Samples, ...]) -> Ends:
    """Return the interval of each flat output's mean, from the interval of its sampled name; None for a known mean."""
    return tuple(_levels(between.get(name), of.of_level) for name, of in zip(names, samples, strict=True))


def _levels(ends: tuple[float, float] | None, samples: Samples) -> tuple[float, float] | None:
    if ends is None:
        return None
    offset = float(samples.stencil.at_rest(0.0))
    gain = float(samples.stencil.at_rest(1.0)) - offset
    low, high = sorted((end - offset) / gain for end in ends)
    return low, high


def _interval(name: str, ends: tuple[float, ...] | list[float]) -> tuple[float, float]:
    if len(ends) != 2 or not all(is_number(end) and abs(end) < inf for end in ends) or not ends[0] < ends[1]:
        raise ValueError(f"mean of {name}: expected a number or [lower, upper] with lower < upper, got {short(ends)}")
    return float(ends[0]), float(ends[1])


def _with_means(prior: JointPrior, means: Sequence[float]) -> JointPrior:
    parts = zip(prior.parts, means, strict=True)
    return prior.with_parts(replace(part, mean=mean) for part, mean in parts)


def _admissible(at_rest: Sequence[Quantity], likeliest: JointPosterior, free: Sequence[bool]) -> list[float]:
    """Return the likeliest prior means, with the `free` ones moved until all quantities keep their bounds at rest.

    −2 ln p is quadratic in the means, so that the moved means are the likeliest admissible ones for these
    hyperparameters. If no equilibrium is admissible, the means are not moved.
    """
    means = [part.mean for part in likeliest.prior.parts]
    moving = np.flatnonzero(free)
    stiffness = np.sqrt([likeliest.parts[c].information_about_mean for c in moving])
    found = (_nearest(at_rest, means, moving, stiffness, room) for room in (_ROOM if len(moving) else ()))
    return next(filter(None, found), means)


def _nearest(
    at_rest: Sequence[Quantity], means: list[float], moving: Indices, stiffness: Array, room: float
) -> list[float] | None:
    """Return means, near those given, with a slack of `room` at each bound, relative to its width.

    They minimise Σ (stiffness · change)², where stiffness² is the samples' information about a mean. Only the means
    with indices in `moving` change, and quantities that do not depend on these means need no slack. None if no such
    means are found.
    """

    def moved(by: Array) -> list[float]:
        found = np.array(means)
        found[moving] += by / stiffness
        return [*found.tolist()]

    beside = moved(np.ones(len(moving)))  # a quantity may depend on a mean at which its derivative is zero
    bounded = [of for of in at_rest if any(of.rates_at_rest(levels)[moving].any() for levels in (means, beside))]
    ends = np.array([(of.bounds.rest.lower, of.bounds.rest.upper) for of in bounded]).reshape(-1, 2)
    start, middle, width = np.zeros(len(moving)), ends.mean(axis=1), np.ptp(ends, axis=1)
    # Changes are measured in units of the least one that meets a bound: steps of the search are of about one unit.
    outside = np.abs([of.at_rest(means) for of in bounded] - middle) - (0.5 - room) * width
    sizes = np.array([np.linalg.norm(of.rates_at_rest(means)[moving] / stiffness) for of in bounded])
    changes = np.divide(outside, sizes, out=np.zeros_like(sizes), where=sizes > 0)
    stiffness = stiffness / (np.max(changes, initial=0.0) or 1.0)

    def evaluate(by: Array) -> sqp.Evaluation | None:
        """Return half the sum of squares, and the relative distance from the nearer bound; None if it is undefined."""
        levels = moved(by)
        off = (np.array([of.at_rest(levels) for of in bounded]) - middle) / width
        rates = np.array([of.rates_at_rest(levels)[moving] for of in bounded]).reshape(-1, len(by)) / stiffness
        slopes = -rates * (np.sign(off) / width)[:, None]
        is_defined = np.isfinite(off).all() and np.isfinite(slopes).all()
        return sqp.Evaluation(float(by @ by) / 2, by, 0.5 - room - np.abs(off), slopes) if is_defined else None

    found = sqp.minimise(evaluate, start, start - inf, start + inf)
    if found is None or found.at.violation > 0:
        return None
    levels = moved(found.x)
    return levels if all(of.is_kept_at_rest(levels) for of in at_rest) else None
