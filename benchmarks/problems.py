"""Problems that are timed, as objects of the library: the paper's examples, plants, recordings and drawn samples."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from benchmarks.harness import ROOT, kept
from benchmarks.rivals.problems import experiment
from pipeline.generate import sampled_by
from pipeline.published.periodic import on_grid
from trackably.arrays import Array, root_mean_square
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.goal import goal_for
from trackably.checker.certificate import Claim
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum
from trackably.learning.learner import JOINT, Learner
from trackably.learning.problem import ConstrainedProblem, Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.recordings import CsvLayout, read_csv
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

NOISE = 0.1


def wave(times: Array) -> Samples:
    """Return samples of a sine with noise at `times` [s]."""
    noise = NOISE * np.random.default_rng(len(times)).standard_normal(len(times))
    return Samples(times, np.sin(times) + noise)


def irregular(n: int) -> Samples:
    """Return n noisy samples at random times, ten a second."""
    return wave(np.sort(np.random.default_rng(n).uniform(0, n / 10, n)))


def regular(n: int, step: float = 0.1) -> Samples:
    """Return n noisy samples, one every `step` seconds."""
    return wave(step * np.arange(n))


PRIOR = JointPrior((Prior(SquaredExponential(1.0, 0.7).as_learned(), NOISE),))
_LOG_THETA = PRIOR.log_hyperparameters


def likelihood(samples: Samples) -> tuple[float, Array]:
    """Return l, the negative log marginal likelihood, and its gradient with respect to ln θ."""
    return JointPosterior(PRIOR.with_log_hyperparameters(_LOG_THETA), (samples,)).negative_log_marginal_likelihood()


def box(sizes: Sequence[float]) -> Polytope:
    """Return {x : |x_i| ≤ sizes[i]}."""
    return Polytope.box([-size for size in sizes], sizes)


def integrator(position: float, velocity: float, acceleration: float, step: float = 0.1) -> ConstrainedSystem:
    """Return a double integrator whose states and input are bounded by these sizes."""
    system = LinearSystem(np.array([[1.0, step], [0.0, 1.0]]), np.array([[step**2 / 2], [step]]), sampling_time=step)
    return ConstrainedSystem(system, box([position, velocity]), box([acceleration]))


def posterior_mean(kernel: Kernel, noise_std: float, samples: Samples) -> tuple[KernelSum, ...]:
    """Return the posterior mean of a process with mean zero, as the only signal of a plant."""
    return JointPosterior(JointPrior((Prior(kernel, noise_std),)), (samples,)).signals


def solved(problem: ConstrainedProblem) -> Solution:
    """Return the best solution; an error ends the comparison if there is none."""
    return kept(best_solution(problem), Solution)


@dataclass(frozen=True)
class Task:
    """The arguments for learning a certified reference, of an experiment or of a problem of the benchmarks."""

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem
    claim: Claim
    starts: int = 8

    @property
    def space(self) -> SearchSpace:
        """The intervals in which hyperparameters are learned."""
        return SearchSpace.around(self.samples, self.prior, self.starts)

    @property
    def problem(self) -> ConstrainedProblem:
        """The learning problem without constraints."""
        return ConstrainedProblem(self.samples, self.prior, self.space)

    def learned(self, learner: Learner = JOINT) -> Certified:
        """Return the reference with its proof; an error ends the benchmark if there is none."""
        goal = goal_for(self.claim, self.samples, self.prior, self.plant)
        return kept(learn_certified(self.problem, self.plant, goal, learner=learner), Certified)

    def at_instants(self, count: int, spacing: float) -> ConstrainedProblem:
        """Return the problem of a scalar system that is bounded at `count` instants, `spacing` [s] apart."""
        return replace(self.problem, constraints=on_grid(self.plant, count, spacing))

    def on_steps(self, last: int) -> ConstrainedProblem:
        """Return problem (4) of the paper: states are bounded up to step `last`, and the inputs that lead to them."""
        return self.at_instants(last, self.plant.sampling_time)

    def with_known(self, prior: JointPrior) -> "Task":
        """Return the same task with the hyperparameters of a prior, all known."""
        return replace(self, prior=prior.as_known())


@cache
def task(name: str, upper: float | None = None) -> Task:
    """Return the task of an experiment of params.yaml, or of the rivals' problem of this name.

    With `upper`, its only state has another upper bound.
    """
    of = experiment(name) if upper is None else experiment(name).with_upper_bound(upper)
    return Task(sampled_by(of).samples, of.learned_prior, of.plant, of.claim, of.search.starts)


def misfit(found: Certified) -> float:
    """Return the root mean square distance of a reference from all samples."""
    pairs = zip(found.solution.posterior.samples, found.solution.signals, strict=True)
    return root_mean_square(np.concatenate([of.stencil.measured(signal, of.times) - of.values for of, signal in pairs]))


REPAIRS = ["drop_zero_rows", "drop_rows_out_of_order", "average_repeated"]
BREATHING = ROOT / "data/recordings/breathing.csv"


def tracked(start: float = 0.0) -> Samples:
    """Return half a minute of a tracker's recording [mm], from `start` [s] on."""
    layout = CsvLayout(separator=";", decimal=",")
    return read_csv(BREATHING, "Timestamp", "ms", {"z": "z"}, layout, REPAIRS).select(start, start + 30.0)["z"]
