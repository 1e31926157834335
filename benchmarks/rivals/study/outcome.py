"""What became of one run: one outcome a rival, without anything that depends on the machine."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.rivals.adapters import fine_grid, governor, ours, splines, tightened, truncated
from benchmarks.rivals.curves import curve_of
from benchmarks.rivals.model import Found, NotFound, Problem
from benchmarks.rivals.study.draws import Run
from trackably.arrays import root_mean_square

_POINTS = 100
_SOLVED = 1e-9  # violations below are a solver's tolerance
_TIMES = 201


def _unconstrained(problem: Problem) -> Found:
    return Found(curve_of(problem.likeliest.posterior.signals, problem))


SOLVERS: dict[str, Callable[[Problem], Found]] = {
    "unconstrained": _unconstrained,
    "grid of 100": partial(fine_grid.solve, points=_POINTS),
    "cones around 100": partial(tightened.solve, points=_POINTS),
    "hat functions, mode": truncated.solve,
    "spline on 100": partial(splines.solve, points=_POINTS),
    "governor": governor.solve,
    "ours, θ alone": ours.alone,
    "ours, joint": ours.joint,
}


@dataclass(frozen=True)
class Outcome:
    """One rival in one run: `answer` is "found" or why not; numbers are parts of the samples' spread.

    `collapsed`: it is off its samples by more than three times what the unconstrained mean is, by more than the noise
    and by more than a tenth of their spread. `violation` is certain, a part of a bound's width; zero below 1e-9.
    """

    index: int
    rival: str
    answer: str
    misfit: float | None = None
    error: float | None = None
    violation: float | None = None
    collapsed: bool = False


def outcomes(index: int) -> list[Outcome]:
    """Let every rival solve the problem of this run."""
    run = Run.of(index)
    problem = run.problem
    found: list[Outcome] = []
    for name, solve in SOLVERS.items():
        try:
            least = (found and found[0].misfit) or np.inf
            found.append(_outcome(run, problem, name, solve(problem), least))
        except NotFound as no:
            found.append(Outcome(index, name, no.kind))
        except (ArithmeticError, np.linalg.LinAlgError) as why:
            found.append(Outcome(index, name, f"failed: {why}"))
    return found


def _outcome(run: Run, problem: Problem, name: str, answer: Found, least: float) -> Outcome:
    (samples,), (truth,) = problem.task.samples, problem.truths
    assert truth is not None
    spread = float(np.ptp(samples.values))
    times = np.linspace(0.0, float(samples.times[-1]), _TIMES)
    misfit = root_mean_square(answer.curve.sampled(0, samples.times) - samples.values) / spread
    error = root_mean_square(answer.curve.sampled(0, times) - truth(times)) / spread
    violation = answer.curve.violation_seen(problem.window).least
    collapsed = misfit > max(3 * least, run.noise * run.case.spread / spread, 0.1)
    return Outcome(run.index, name, "found", misfit, error, violation if violation > _SOLVED else 0.0, collapsed)
