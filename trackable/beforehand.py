"""What is learned before bounds count: prior means, and hyperparameters from samples of their own."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from reprlib import repr as short

from trackable.arguments import is_number
from trackable.fit.edges import edges_of
from trackable.gp.joint import JointPrior
from trackable.gp.samples import Samples
from trackable.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackable.learning.search import best_solution
from trackable.learning.space import SearchSpace

Mean = float | tuple[float, float]
"""A prior mean that is known, or learned between two values, in the unit of what is sampled."""

Ends = tuple[tuple[float, float] | None, ...]
"""The interval of each flat output's mean; None where it is known."""


@dataclass(frozen=True)
class Beforehand:
    """The prior to go on with, and the sentences that ask about intervals which held it back."""

    prior: JointPrior
    questions: tuple[str, ...] = ()


def learned_beforehand(
    samples: tuple[Samples, ...], prior: JointPrior, between: Ends, starts: int, keep: bool
) -> Beforehand | NoSolution:
    """Learn means and hyperparameters from samples, without bounds: by maximum likelihood.

    `keep`: the hyperparameters are known from now on; otherwise they are learned again, with the bounds, and only means
    that lie `between` two values are learned here.
    """
    if not (keep or any(between)):
        return Beforehand(prior)
    space = SearchSpace.around(samples, prior, starts)
    found = best_solution(ConstrainedProblem(samples, prior, space, means=between))
    if not isinstance(found, Solution):
        return found
    likeliest = found.posterior.prior
    questions = [*_held_back(likeliest, between)]
    if keep:
        narrow = [edge for edge in edges_of(likeliest, samples) if edge.is_given]
        questions += [f"{edge}, {edge.interval}: was it meant as a limit?" for edge in narrow]
        return Beforehand(likeliest.as_known(), tuple(questions))
    parts = zip(prior.parts, likeliest.parts, strict=True)
    return Beforehand(prior.with_parts(tuple(replace(own, mean=of.mean) for own, of in parts)), tuple(questions))


def split_means(
    mean: Mean | Mapping[str, Mean], names: tuple[str, ...]
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Return a mean for each name, and the intervals of those that are learned. ValueError: no such interval."""
    given = mean if isinstance(mean, Mapping) else dict.fromkeys(names, mean)
    between = {name: _interval(name, one) for name, one in given.items() if isinstance(one, tuple | list)}
    known = {name: one for name, one in given.items() if not isinstance(one, tuple | list)}
    return {**known, **{name: sum(ends) / 2 for name, ends in between.items()}}, between


def levels(between: Mapping[str, tuple[float, float]], names: tuple[str, ...], samples: tuple[Samples, ...]) -> Ends:
    """Return the intervals of the flat outputs' levels, from those of what is sampled."""
    return tuple(_levels(between.get(name), of.of_level) for name, of in zip(names, samples, strict=True))


def _levels(ends: tuple[float, float] | None, samples: Samples) -> tuple[float, float] | None:
    if ends is None:
        return None
    offset = float(samples.stencil.at_rest(0.0))
    gain = float(samples.stencil.at_rest(1.0)) - offset
    low, high = sorted((end - offset) / gain for end in ends)
    return low, high


def _interval(name: str, ends: tuple[float, ...] | list[float]) -> tuple[float, float]:
    if len(ends) != 2 or not all(is_number(end) and abs(end) < float("inf") for end in ends) or not ends[0] < ends[1]:
        raise ValueError(f"mean of {name}: expected a number or [lower, upper] with lower < upper, got {short(ends)}")
    return float(ends[0]), float(ends[1])


def _held_back(prior: JointPrior, between: Ends) -> list[str]:
    return [
        f"mean: that of {name} lies at an end of the interval in which it was sought: was it meant as a limit?"
        for name, part, ends in zip(prior.names, prior.parts, between, strict=True)
        if ends and part.mean in ends
    ]
