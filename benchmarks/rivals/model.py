"""What a rival is, what it is asked, and what it may answer."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

from benchmarks.rivals.judge import Curve
from pipeline.experiments import Experiment
from pipeline.generate import sampled_by
from pipeline.methods import Task
from pipeline.published.ground_truth import GroundTruth
from pipeline.storage.archive import Sampled
from trackably.gp.joint import JointPrior
from trackably.learning.problem import Solution
from trackably.learning.search import best_solution


@dataclass(frozen=True, eq=False)
class Problem:
    """Samples, a system, its sets and a claim, as an experiment has them.

    With `tightness`, it is one of several whose bound is tightened: its place on the abscissa.
    """

    experiment: Experiment
    tightness: float | None = None

    @property
    def name(self) -> str:
        """As tables show it."""
        return self.experiment.name if self.tightness is None else f"{self.experiment.name} ≤ {self.tightness:g}"

    @cached_property
    def sampled(self) -> Sampled:
        """The samples, and those held out."""
        return sampled_by(self.experiment)

    @cached_property
    def task(self) -> Task:
        """What the methods of this project learn from."""
        return self.experiment.task(self.sampled.samples)

    @cached_property
    def likeliest(self) -> Solution:
        """The minima of the negative log likelihood, without bounds: what a user has before there are any.

        NotFound: no minimum is found.
        """
        found = best_solution(self.task.problem)
        if not isinstance(found, Solution):
            raise NotFound("failed", found.explanation)
        return found

    def forgotten(self) -> "Problem":
        """Return the same problem with nothing learned: each rival's time contains what it needs."""
        fresh = replace(self)
        fresh.__dict__.update(sampled=self.sampled, task=self.task)
        return fresh

    @property
    def window(self) -> tuple[float, float]:
        """The times [s] in which violations are looked for."""
        return 0.0, self.experiment.verification.last_step * self.task.plant.sampling_time

    @property
    def span(self) -> tuple[float, float]:
        """From the first time [s] at which all flat outputs are sampled, to the last at which one is."""
        first, last = zip(*((float(of.times[0]), float(of.times[-1])) for of in self.task.samples), strict=True)
        return max(first), max(last)

    @property
    def truths(self) -> tuple[GroundTruth | None, ...]:
        """The signal behind the samples of each flat output, where it is known."""
        known = self.experiment.truths
        return tuple(known.get(name) for name in self.sampled.names)


@dataclass(frozen=True)
class Found:
    """A curve; the rival's own `objective` is described by `minimises`, and bounds were asked for at `places` times.

    `prior` has the hyperparameters where there are any. `says` is what the rival says about this curve. A curve that
    was not made from the samples, but only from its two ends, `ignores_samples`.
    """

    curve: Curve
    objective: float | None = None
    minimises: str = ""
    places: int | None = None
    prior: JointPrior | None = None
    says: str = ""
    ignores_samples: bool = False
    last: float | None = None
    """The end [s] of the curve, where it ends before the window does."""


@dataclass(eq=False)
class NotFound(ArithmeticError):
    """No curve: `kind` is "infeasible", "unproved", "failed" or "does not apply", and `why` is a sentence."""

    kind: str
    why: str


@dataclass(frozen=True)
class Rival:
    """Something that hands out trajectories.

    `solve` is given a problem, and raises NotFound where it has no curve. What the documentation says of bounds is a
    short `quote` and where it stands, its `source`; or a `summary` in our words. `needs` are the packages it is made
    of, and `licence` is theirs.
    """

    letter: str
    name: str
    solve: Callable[[Problem], Found]
    source: str
    quote: str = ""
    summary: str = ""
    needs: tuple[str, ...] = ()
    licence: str = ""
