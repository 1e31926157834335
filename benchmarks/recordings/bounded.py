"""Recordings that break bounds: the misfit of proved references, beside a quadratic program on a fine grid."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from time import process_time

import numpy as np
import scipy

from benchmarks.duel import Row
from benchmarks.learned import Task, held_out, misfit, task
from benchmarks.machine import ROOT
from benchmarks.recordings.cycle import drive_cycle
from trackably.arrays import Array
from trackably.certificates.certified import Certified
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.learner import HYPERPARAMETERS, JOINT
from trackably.learning.methods import unconstrained
from trackably.learning.problem import Solution
from trackably.learning.space import SearchSpace
from trackably.recordings import CsvLayout, read_csv
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Interval, Polytope

_TOPIC = "recordings under bounds"
_PROGRAM = "quadratic program on a fine grid"
_WITHIN = 1.3
_SMALLEST = 1e-6  # a weight that only makes the program's minimiser unique
_WEIGHTS = (1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0)
_FOLDS = 5
_NO_TIMES = (np.nan, np.nan)


def rows() -> Iterator[Row]:
    """Breathing with less speed than recorded; a drive cycle with v ≥ 0 and |a| ≤ 2; the robot axis, held out."""
    yield from _breathing()
    yield from _drive_cycle()
    yield _robot_axis()


@dataclass(frozen=True)
class Grid:
    """Bounds of a signal and of its first derivative, for functions that are linear between times `step` [s] apart."""

    values: Interval
    slopes: Interval
    step: float

    def smoothed(self, samples: Samples, order: int, weight: float, seen: Array | None = None) -> Array:
        """Return min ‖y − x‖² + weight ∫ (dᵒx/dtᵒ)² under the bounds, at all samples; it only sees those in `seen`."""
        import cvxpy as cp

        steps = samples.times / self.step
        before = np.floor(steps).astype(int)
        count = int(before[-1]) + 2
        part = steps - before
        at_samples = scipy.sparse.csr_array(
            (
                np.concatenate([1 - part, part]),
                (np.tile(np.arange(len(samples)), 2), np.concatenate([before, before + 1])),
            ),
            shape=(len(samples), count),
        )
        kept = np.arange(len(samples)) if seen is None else np.flatnonzero(seen)
        x = cp.Variable(count)
        slope = cp.diff(x) / self.step
        rough = cp.diff(x, order) / self.step**order
        cost = cp.sum_squares(at_samples[kept] @ x - samples.values[kept]) + weight * self.step * cp.sum_squares(rough)
        bounds = [
            x >= self.values.lower,
            x <= self.values.upper,
            slope >= self.slopes.lower,
            slope <= self.slopes.upper,
        ]
        cp.Problem(cp.Minimize(cost), bounds).solve(solver="CLARABEL")
        return np.asarray(at_samples @ x.value)

    def best_weight(self, samples: Samples, order: int) -> float:
        """Return the weight that predicts left out samples best: every fifth one, in the middle of five."""
        out = np.arange(len(samples)) % _FOLDS == _FOLDS // 2

        def error(weight: float) -> float:
            found = self.smoothed(samples, order, weight, ~out)
            return float(np.mean((found - samples.values)[out] ** 2))

        return min(_WEIGHTS, key=error)


def _integrator(samples: Samples, kernel: Kernel, mean: float, grid: Grid, sampling_time: float) -> Task:
    """Return the task for x⁺ = x + T_s u with the bounds of the grid: u is the mean slope of a sampling interval."""
    system = LinearSystem.scalar(1.0, sampling_time, sampling_time=sampling_time)
    boxes = (Polytope.box([bounds.lower], [bounds.upper]) for bounds in (grid.values, grid.slopes))
    prior = JointPrior((Prior(kernel, None, mean),))
    window = (float(samples.times[0]), float(samples.times[-1]))
    return Task((samples,), prior, ConstrainedSystem(system, *boxes), window, starts=4)


def _breathing() -> Iterator[Row]:
    """Follow half a minute of breathing with 0.8 of the speed that was recorded."""
    samples = breathing()
    free = Grid(Interval(-20.0, 20.0), Interval(-100.0, 100.0), 0.02)
    wide = _integrator(samples, SquaredExponential(), 0.0, free, 0.01)
    fastest = 0.8 * _fastest(wide)
    grid = replace(free, slopes=Interval(-fastest, fastest))
    asked = _integrator(samples, SquaredExponential(), 0.0, grid, 0.01)
    program = _root_mean_square(grid.smoothed(samples, 2, _SMALLEST) - samples.values)
    name = f"breathing, {len(samples)} samples, |v| ≤ {fastest:.3g} mm/s"
    yield from _compared(replace(asked, claim="all_times"), name, program, f"{program:.3g} mm")


def breathing() -> Samples:
    """Return the first 30 s of the tracker's recording [mm], about the median."""
    table, layout = ROOT / "data" / "recordings" / "breathing.csv", CsvLayout(separator=";", decimal=",")
    repairs = ["drop_zero_rows", "drop_rows_out_of_order", "average_repeated"]
    recorded = read_csv(table, "Timestamp", "ms", {"z": "z"}, layout, repairs)["z"].select(0.0, 30.0).samples()
    return Samples(recorded.times, recorded.values - np.median(recorded.values))


def _drive_cycle() -> Iterator[Row]:
    samples, truth = drive_cycle()
    grid = Grid(Interval(0.0, 40.0), Interval(-2.0, 2.0), 0.25)
    asked = _integrator(samples, Matern52(), 15.0, grid, 0.1)
    weight = grid.best_weight(samples, 3)
    smooth, rough = (grid.smoothed(samples, 3, of) for of in (weight, _SMALLEST))
    program = _root_mean_square(smooth - samples.values)
    missed = f"its smoothness chosen by samples left out; the truth by {_root_mean_square(smooth - truth):.3g}"
    followed = f"with a weight of 0 it misses by {_root_mean_square(rough - samples.values):.3g} only"
    noisy = f"and the truth by {_root_mean_square(rough - truth):.3g}: it follows the noise"
    note = f"{program:.3g} m/s, {missed}; {followed}, {noisy}"
    yield from _compared(asked, f"drive cycle, {len(samples):,} samples".replace(",", " ", 1), program, note, truth)


def _robot_axis() -> Row:
    """Predict the samples of the robot axis that were held out, within its bounds."""
    asked, later = task("robot-axis"), held_out("robot-axis")

    def error(found: Certified) -> float:
        return _root_mean_square(found.reference.state_at(later.times)[:, 0] - later.values)

    joint, alone = error(asked.learned(JOINT)), error(asked.learned(HYPERPARAMETERS))
    note = f"{joint:.3g} mm beside {alone:.3g} mm"
    return Row(_TOPIC, "robot axis, 5.4 s held out: error", "θ alone", *_NO_TIMES, *(joint / alone,) * 3, note=note)


def _compared(asked: Task, name: str, program: float, note: str, truth: Array | None = None) -> Iterator[Row]:
    """Compare the misfit of a proved reference with that of the program and of θ alone, and say what it took."""
    (samples,) = asked.samples
    before = process_time()
    joint = asked.learned(JOINT)
    taken = process_time() - before
    own, alone = misfit(joint, asked.samples), misfit(asked.learned(HYPERPARAMETERS), asked.samples)
    solution = joint.solution
    beside = (
        "" if truth is None else f", to the truth {_root_mean_square(solution.signals[0](samples.times) - truth):.3g}"
    )
    told = f"{own:.3g}{beside}; {len(solution.active_bounds)} bounds active; {taken:.3g} s, proof included"
    ratio = Row(_TOPIC, f"{name}: misfit", _PROGRAM, *_NO_TIMES, *(own / program,) * 3, at_most=True)
    yield replace(ratio, target=_WITHIN, note=f"{told}; program: {note}")
    yield replace(
        ratio, rival="θ alone", ratio=own / alone, lowest=own / alone, highest=own / alone, note=f"{alone:.3g}"
    )


def _fastest(asked: Task) -> float:
    """Return the largest speed of what the samples say without bounds."""
    space = SearchSpace.around(asked.samples, asked.prior, asked.starts)
    found = unconstrained(asked.samples, asked.prior, asked.plant, space)
    assert isinstance(found, Solution), found.explanation
    (times,) = (of.times for of in asked.samples)
    fine = np.linspace(times[0], times[-1], 20 * len(times))
    return float(np.max(np.abs(found.signals[0].jet(fine, 1)[1])))


def _root_mean_square(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
