"""Bounds that are active for long: learning with proof, beside a quadratic program on a fine grid for the same θ.

The program has ten points between samples and the same hyperparameters. For Matérn kernels it is the sparse state-space
form: the process and its derivatives at all points are the unknowns, and each step costs what it differs from its
prediction, in the unit of the process noise. For squared exponentials it is the low-rank form: the process at all
points by the eigenvectors of its covariance that are not negligible, whose coefficients are standard normal. CLARABEL
solves it through cvxpy, whose own time is left out.

Plants whose formulas bend have no such program: their seconds are beside ten, and the misfit of a robot that has to
move is beside that of one which may stand.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from time import process_time
from typing import Any

import numpy as np
import scipy

from benchmarks.duel import FAILURES, Row
from benchmarks.learned import Task, misfit
from benchmarks.machine import ROOT
from benchmarks.recordings.bounded import breathing
from benchmarks.recordings.cycle import drive_cycle
from trackably import Periodic, learn_reference
from trackably.arrays import Array
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.learner import FUNCTION, JOINT, Learner
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.library import kinematic_bicycle, mobile_robot, tank
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

_TOPIC = "active bounds"
_GIVEN, _LEARNED, _MISFIT = 3.0, 10.0, 1.05  # times the program's
_BETWEEN = 10  # points of the program from one sample to the next
_NEGLIGIBLE = 1e-12  # of the largest eigenvalue
_ON_BOUNDS = 0.7  # of the time
_MOST_POINTS = 4000  # of a dense covariance
_KERNELS: dict[str, Callable[[], Kernel]] = {
    "squared exponential": SquaredExponential,
    "Matérn 3/2": Matern32,
    "Matérn 5/2": Matern52,
}


@dataclass(frozen=True)
class Problem:
    """Regular samples of x in x⁺ = x + T_s u with bounds of x and u, of which θ is learned with a `kernel`."""

    name: str
    samples: Samples
    states: tuple[float, float]
    inputs: tuple[float, float]
    sampling_time: float
    kernel: str
    mean: float = 0.0

    @property
    def task(self) -> Task:
        system = LinearSystem.scalar(1.0, self.sampling_time, sampling_time=self.sampling_time)
        boxes = (Polytope.box([low], [high]) for low, high in (self.states, self.inputs))
        prior = JointPrior((Prior(_KERNELS[self.kernel](), None, self.mean),))
        window = (float(self.samples.times[0]), float(self.samples.times[-1]))
        return Task((self.samples,), prior, ConstrainedSystem(system, *boxes), window, starts=4)


def problems() -> Iterator[Problem]:
    """Return drive cycles, breathing with less speed than recorded, and signals whose input is on its bounds."""
    table = np.loadtxt(ROOT / "benchmarks" / "rivals" / "data" / "udds.csv", delimiter=",", skiprows=1)
    urban = Samples(table[:, 0], 0.44704 * table[:, 1])
    cycle, _ = drive_cycle(1800)
    for kernel in _KERNELS:
        yield Problem("UDDS", urban, (-0.05, 26.0), (-1.5, 1.5), 0.2, kernel, 8.7)
        yield Problem("drive cycle", cycle, (0.0, 40.0), (-1.2, 1.2), 0.1, kernel, 15.0)
        for count, speed in ((300, 8.0), (300, 5.0), (1200, 8.0), (1200, 5.0)):
            yield Problem(
                f"breathing, |v| ≤ {speed:g}", _breathing(count), (-20.0, 20.0), (-speed, speed), 0.01, kernel
            )
        for count in (100, 300, 1000, 3000):
            yield axis(count, kernel)


def rows() -> Iterator[Row]:
    """Yield times beside those of the program, with θ learned and for this θ, and the misfit beside its misfit."""
    for problem in problems():
        yield from measured(problem)
    yield from bending_rows()


_SECONDS = 10.0
_NOT_SLOWER = 1.1  # times the misfit of a robot that may stand


def bending() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield arguments of `learn_reference`: robots that stop, an eight, a bicycle, a tank."""
    draw = np.random.default_rng(0)
    any_heading, t = float("inf"), np.arange(0.0, 8.01, 0.2)

    def noisy(times: Array, noise: float, **paths: Array) -> dict[str, Samples]:
        return {name: Samples(times, path + noise * draw.standard_normal(len(times))) for name, path in paths.items()}

    def planar(system: Any, low: list[float], high: list[float], inputs: Polytope) -> ConstrainedSystem:
        return ConstrainedSystem(system, Polytope.box([*low, -any_heading], [*high, any_heading]), inputs)

    x = 4 * _eased((t - 0.5) / 7)
    corridor, driven = noisy(t, 0.02, x=x, y=0.5 * np.sin(1.5 * np.pi * x / 4)), mobile_robot(0.1)
    known = {"kernel": SquaredExponential(), "noise_std": 0.02, "claim": (0.0, 8.0)}
    for slowest in (0.0, 0.05):
        plant = planar(driven, [-1.0, -0.4], [5.0, 0.4], Polytope.box([slowest, -1.5], [0.9, 1.5]))
        yield f"robot that stops, v ≥ {slowest:g}", {"samples": corridor, "plant": plant, **known}
    at = np.arange(48) / 4
    eight = noisy(at, 0.03, x=2 * np.sin(np.pi * at / 6), y=1.2 * np.sin(np.pi * at / 3))
    plant = planar(driven, [-1.9, -1.1], [1.9, 1.1], Polytope.box([0.3, -1.6], [1.5, 1.6]))
    of_eight = {"kernel": Periodic(period=12.0), "noise_std": 0.03, "claim": "all_phases", "mean": 0.0}
    yield "eight of 2 × 48 samples", {"samples": eight, "plant": plant, **of_eight}
    swerve = noisy(t, 0.02, x=t, y=1.5 * _eased((t - 1) / 5))
    plant = planar(kinematic_bicycle(0.1, 0.5), [-1.0, -0.1], [10.0, 1.6], Polytope.box([0.5, -0.2], [1.15, 0.2]))
    yield "bicycle", {"samples": swerve, "plant": plant, **known}
    filled = np.linspace(0.0, 16.0, 40)
    plant = ConstrainedSystem(tank(0.1, 1.0, 0.1), Polytope.box([0.5], [1.35]), Polytope.box([0.0], [0.25]))
    yield (
        "tank",
        {
            "samples": noisy(filled, 0.02, level=1.2 + 0.25 * np.sin(filled)),
            "plant": plant,
            **{**known, "claim": (0.0, 16.0), "mean": 1.0},
        },
    )


def bending_rows() -> Iterator[Row]:
    """Yield the seconds of each beside ten, and how far a robot that has to move is off beside one that may stand."""
    misfits = dict[str, float]()
    for name, given in bending():
        before = process_time()
        try:
            found = learn_reference(**given, starts=4, progress=False)
        except FAILURES as why:
            yield Row.failed(_TOPIC, name, f"{_SECONDS:g} s", why)
            continue
        taken = process_time() - before
        misfits[name] = float(np.hypot.reduce(list(found.misfit.values())))
        told = f"J = {found.objective:.6g}, gap {found.duality_gap:.2g}, starts differ by {found.fit.spread:.2g}"
        ratio = taken / _SECONDS
        yield Row(_TOPIC, name, f"{_SECONDS:g} s", taken, _SECONDS, *(ratio,) * 3, 1.0, note=told, at_most=True)
    of_robots = [misfit for name, misfit in misfits.items() if name.startswith("robot")]
    if len(of_robots) == 2:
        ratio, name = of_robots[1] / of_robots[0], "robot that stops: misfit, v ≥ 0.05"
        yield Row(_TOPIC, name, "v ≥ 0", np.nan, np.nan, *(ratio,) * 3, _NOT_SLOWER, at_most=True)


def _eased(part: Array) -> Array:
    """Return a motion from 0 to 1 with the least jerk."""
    part = np.clip(part, 0.0, 1.0)
    return np.asarray(10 * part**3 - 15 * part**4 + 6 * part**5)


def measured(problem: Problem) -> Iterator[Row]:
    """Yield the three rows of a problem. The `note` has the gap that is said and the number of active bounds."""
    name = f"{problem.name}, {len(problem.samples)} samples, {problem.kernel}"
    row = partial(Row, _TOPIC, at_most=True)
    try:
        joint, taken = _timed(problem.task, JOINT)
        known = problem.task.with_known(joint.solution.posterior.prior)
        given, taken_given = _timed(known, FUNCTION)
        own = misfit(given, (problem.samples,))
        active = len(given.solution.active_bounds)
        told = f"J = {joint.solution.objective:.6g}, back-off {joint.backoff:.1g}, {active} bounds active"
        beside = by_program(problem, known.prior.parts[0])
    except FAILURES as why:
        yield Row.failed(_TOPIC, name, "program on a fine grid", why)
        return
    for what, own_seconds, target in (("θ learned", taken, _LEARNED), ("θ given", taken_given, _GIVEN)):
        ratio = own_seconds / beside.seconds
        yield row(
            f"{name}: {what}", "program for this θ", own_seconds, beside.seconds, *(ratio,) * 3, target, note=told
        )
    ratio = own / beside.misfit
    yield row(f"{name}: misfit", "program for this θ", np.nan, np.nan, *(ratio,) * 3, _MISFIT, note=f"{own:.4g}")


@dataclass(frozen=True)
class Minimiser:
    """The root mean square of what the program's minimiser is off, its value, and the seconds that CLARABEL takes."""

    misfit: float
    value: float
    seconds: float


def by_program(problem: Problem, prior: Prior, drawn_in: float = 0.0) -> Minimiser:
    """Solve the program; its bounds are drawn in by a part of their widths."""
    import cvxpy as cp

    samples, apart = problem.samples, float(np.median(np.diff(problem.samples.times)))
    points = np.arange(_BETWEEN * round((samples.times[-1] - samples.times[0]) / apart) + 1)
    step = apart / _BETWEEN
    values, price = _states(cp, prior, len(points), step)
    at = np.rint((samples.times - samples.times[0]) / step).astype(int)
    off = (values[at] + problem.mean - samples.values) / float(prior.noise_std)
    slopes = cp.diff(values) / step
    (low, high), (slowest, fastest) = (
        (one + drawn_in * (other - one), other - drawn_in * (other - one))
        for one, other in (problem.states, problem.inputs)
    )
    bounds = [values >= low - problem.mean, values <= high - problem.mean, slopes >= slowest, slopes <= fastest]
    program = cp.Problem(cp.Minimize(cp.sum_squares(off) + price), bounds)
    program.solve(solver="CLARABEL")
    assert values.value is not None, program.status
    misses = float(np.sqrt(np.mean((values.value[at] + problem.mean - samples.values) ** 2)))
    return Minimiser(misses, float(program.value), float(program.solver_stats.solve_time))


def _states(cp: Any, prior: Prior, count: int, step: float) -> tuple[Any, Any]:
    """Return the process at all points, less its mean, and what it costs by its norm."""
    kernel = prior.kernel
    if isinstance(kernel, Matern32 | Matern52):
        transition, root = _markov(kernel, step)
        x = cp.Variable((count, len(transition)))
        innovations = (x[1:] - x[:-1] @ transition.T) @ np.linalg.inv(root).T
        begun = np.linalg.inv(np.linalg.cholesky(_stationary(kernel))) @ x[0]
        return x[:, 0], cp.sum_squares(innovations) + cp.sum_squares(begun)
    if count > _MOST_POINTS:
        raise RuntimeError(f"a dense covariance of {count} points is not decomposed")
    powers, vectors = np.linalg.eigh(kernel(step * np.subtract.outer(np.arange(count), np.arange(count))))
    kept = powers > _NEGLIGIBLE * powers[-1]
    coefficients = cp.Variable(int(np.count_nonzero(kept)))
    return (vectors[:, kept] * np.sqrt(powers[kept])) @ coefficients, cp.sum_squares(coefficients)


def _markov(kernel: Matern32 | Matern52, step: float) -> tuple[Array, Array]:
    """Return the transition of (g, g', …) over a step, and a root of the covariance of what it does not foretell."""
    before = _stationary(kernel)
    order = len(before)
    signs = (-1.0) ** np.arange(order)
    jet = kernel.jet(np.array(step), 2 * order - 2)
    across = np.array([[jet[i + j] * signs[j] for j in range(order)] for i in range(order)])
    transition = across @ np.linalg.inv(before)
    return transition, np.linalg.cholesky(before - transition @ across.T)


def _stationary(kernel: Matern32 | Matern52) -> Array:
    """Return the covariance of (g, g', …) at one time, as many as there are."""
    order = 2 if isinstance(kernel, Matern32) else 3
    jet = kernel.jet(np.zeros(()), 2 * order - 2)
    return np.array([[jet[i + j] * (-1.0) ** j for j in range(order)] for i in range(order)])


def _timed(task: Task, learner: Learner) -> tuple[Any, float]:
    before = process_time()
    found = task.learned(learner)
    return found, process_time() - before


def _breathing(count: int) -> Samples:
    """Return half a minute of breathing at regular times, by splines: a tracker's own are nearly so."""
    recorded = breathing()
    times = np.arange(count) * (30.0 / count)
    noise = 0.02 * np.random.default_rng(count).standard_normal(count)
    return Samples(times, scipy.interpolate.PchipInterpolator(recorded.times, recorded.values)(times) + noise)


def axis(count: int, kernel: str, seed: int = 0) -> Problem:
    """Return noisy samples of a sum of sines whose speed is cut off, so that it is on its bounds most of the time."""
    draw, apart, fine = np.random.default_rng(seed), 0.1, 0.01
    t = fine * np.arange(round(count * apart / fine) + 1)
    phases, periods, sizes = draw.uniform(0, 2 * np.pi, 3), np.array([7.3, 4.1, 2.6]), np.array([1.0, 0.7, 0.4])
    speed = np.cos(2 * np.pi * np.outer(t, 1 / periods) + phases) @ (2 * np.pi * sizes / periods)
    fastest = float(np.quantile(np.abs(speed), 1 - _ON_BOUNDS))
    position = fine * np.cumsum(np.clip(speed, -fastest, fastest))
    position -= np.linspace(0.0, position[-1], len(position))
    times = apart * np.arange(count)
    noise = 0.02 * np.std(position) * draw.standard_normal(count)
    samples, width = Samples(times, np.interp(times, t, position) + noise), 3 * float(np.ptp(position))
    return Problem("axis on its bounds", samples, (-width, width), (-fastest, fastest), fine, kernel)
