"""What defaults do to recordings: `learn_reference` is given samples, a plant, a kernel and a claim, and nothing else.

Two laws, of recordings whose speed is bounded to less than they have:

- With the prior mean left out, the misfit is at most 1.05 times that with the true mean given, of signals made up far
  from zero.
- Every fifth sample, in the middle of five, is left out. The error there is at most 1.1 times that of the best of three
  quadratic programs on a fine grid, whose smoothness weights are a decade apart. Which of them is best is told by the
  samples that are left out: no rule that chooses a weight does better.

`python -m benchmarks.recordings.defaults FILE.csv …` takes further recordings in the form of
data/recordings/breathing.csv.
"""

import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from benchmarks.duel import FAILURES, Row
from benchmarks.machine import ROOT
from benchmarks.rivals.problems import experiment
from pipeline.generate import sampled_by
from trackably import (
    ConstrainedSystem,
    CsvLayout,
    LinearSystem,
    Matern32,
    Matern52,
    Polytope,
    Samples,
    SquaredExponential,
    TrackableReference,
    learn_reference,
    read_csv,
)
from trackably.arrays import Array
from trackably.certificates.goal import Claim
from trackably.gp.kernels.base import Kernel
from trackably.systems.polytopes import Interval

Chosen = npt.NDArray[np.bool_]

MISFIT, HELD_OUT = 1.05, 1.1
_TOPIC = "defaults alone"
_MATERN = ("Matérn 5/2",)
_FOLDS = 5
_DECADES = 0.1, 1.0, 10.0
LEVELS = 293.15, 80.0, -1200.0
_NO_TIMES = (np.nan, np.nan)
_REPAIRS = ["drop_zero_rows", "drop_rows_out_of_order", "average_repeated"]
KERNELS: dict[str, Callable[[], Kernel]] = {
    "squared exponential": SquaredExponential,
    "Matérn 3/2": Matern32,
    "Matérn 5/2": Matern52,
}


@dataclass(frozen=True)
class Bounds:
    """Bounds of a signal and of its first two derivatives; None: the second is free."""

    values: Interval
    slopes: Interval
    curvatures: Interval | None = None

    @property
    def each(self) -> list[tuple[int, Interval]]:
        """The order of each derivative that is bounded, and its bounds."""
        found = [(0, self.values), (1, self.slopes), (2, self.curvatures)]
        return [(order, bounds) for order, bounds in found if bounds]


@dataclass(frozen=True, eq=False)
class Recording:
    """Samples of the first state of a plant, and what programs on a grid need: `bounds`, and times `step` [s] apart.
    `weight` is that of the middle one; `mean` is the true mean of a signal that is made up. The laws are asked of
    `kernels`: a squared exponential has all derivatives, which a person's motion has not.
    """

    name: str
    samples: Samples
    plant: ConstrainedSystem
    claim: Claim
    bounds: Bounds
    step: float
    weight: float
    kernels: tuple[str, ...] = _MATERN
    mean: float | None = None

    @property
    def seen(self) -> Chosen:
        """Which samples are learned from: all but every fifth one, in the middle of five."""
        return np.asarray(np.arange(len(self.samples)) % _FOLDS != _FOLDS // 2)

    def learned(self, kernel: Kernel, seen: Chosen | None = None, **options: Any) -> TrackableReference:
        """Return a reference learned from some of the samples, from all by default."""
        of = self.samples
        part = of if seen is None else Samples(of.times[seen], of.values[seen])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return learn_reference(part, self.plant, kernel, self.claim, progress=False, **options)

    def misfit(self, found: TrackableReference, at: Chosen | None = None) -> float:
        """Return the root mean square of reference minus samples, at some of them or at all."""
        off = found.reference.state_at(self.samples.times)[:, 0] - self.samples.values
        return _root_mean_square(off if at is None else off[at])

    def held_out(self, kernel: Kernel, **options: Any) -> float:
        """Return the error of a reference at the samples that it has not seen."""
        return self.misfit(self.learned(kernel, self.seen, **options), ~self.seen)

    def held_out_by_programs(self, weights: Iterable[float] | None = None) -> dict[float, float]:
        """Return the same of quadratic programs, by their smoothness weight."""
        three = [decade * self.weight for decade in _DECADES]
        return {weight: self._by_program(weight) for weight in weights or three}

    def _by_program(self, weight: float) -> float:
        """Return the error of min ‖y − x‖² + weight ∫ x‴² under the bounds, x linear between the times of a grid."""
        import cvxpy as cp

        steps = (self.samples.times - self.samples.times[0]) / self.step
        before = np.floor(steps).astype(int)
        count, rows = int(before[-1]) + 2, np.arange(len(steps))
        places = (np.concatenate([rows, rows]), np.concatenate([before, before + 1]))
        part = steps - before
        at_samples = scipy.sparse.csr_array((np.concatenate([1 - part, part]), places), shape=(len(steps), count))
        level = float(np.mean(self.samples.values))  # the program is solved about it: solvers are scaled for that
        kept = np.flatnonzero(self.seen)
        x = cp.Variable(count)
        rough = cp.diff(x, 3) / self.step**3
        off = at_samples[kept] @ x - (self.samples.values[kept] - level)
        bounded = [
            (x if order == 0 else cp.diff(x, order) / self.step**order, each) for order, each in self.bounds.each
        ]
        moved = [
            (of, each if of is not x else Interval(each.lower - level, each.upper - level)) for of, each in bounded
        ]
        constraints = [side for of, each in moved for side in (of >= each.lower, of <= each.upper)]
        cost = cp.sum_squares(off) + weight * self.step * cp.sum_squares(rough)
        cp.Problem(cp.Minimize(cost), constraints).solve(solver="CLARABEL")
        return _root_mean_square((at_samples @ x.value + level - self.samples.values)[~self.seen])


def made_up(level: float, count: int = 80, seed: int = 0) -> Recording:
    """Return a sum of three sines about a level, in noise, under bounds on value and speed; the speed's are broken."""
    draw = np.random.default_rng(seed)
    times = 0.15 * np.arange(count) + draw.uniform(-0.03, 0.03, count)
    phases, periods, sizes = draw.uniform(0, 2 * np.pi, 3), np.array([6.3, 3.1, 1.9]), np.array([1.0, 0.5, 0.25])

    def signal(t: Array, order: int = 0) -> Array:
        omega = 2 * np.pi / periods
        return np.asarray(np.sin(np.outer(t, omega) + phases + order * np.pi / 2) @ (sizes * omega**order))

    values = level + 10 * signal(times) + 0.8 * draw.standard_normal(count)
    fastest = 0.8 * 10 * float(np.max(np.abs(signal(np.linspace(0, 0.15 * count, 4000), 1))))
    bounds = Bounds(Interval(level - 22.0, level + 22.0), Interval(-fastest, fastest))
    window = (float(times[0]), float(times[-1]))
    return Recording(
        f"made up about {level:g}",
        Samples(times, values),
        _integrator(bounds, 0.05),
        window,
        bounds,
        0.025,
        1e-4,
        tuple(KERNELS),
        level,
    )


def _integrator(bounds: Bounds, sampling_time: float) -> ConstrainedSystem:
    system = LinearSystem.scalar(1.0, sampling_time, sampling_time=sampling_time)
    boxes = (Polytope.box([each.lower], [each.upper]) for each in (bounds.values, bounds.slopes))
    return ConstrainedSystem(system, *boxes)


def _axis_of_robot(bounds: Bounds) -> ConstrainedSystem:
    """Return a double integrator, sampled at 100 Hz."""
    assert bounds.curvatures
    system = LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.01)
    lower, upper = [bounds.values.lower, bounds.slopes.lower], [bounds.values.upper, bounds.slopes.upper]
    return ConstrainedSystem(
        system, Polytope.box(lower, upper), Polytope.box([bounds.curvatures.lower], [bounds.curvatures.upper])
    )


def breathing(path: Path, start: float = 0.0, every: int = 1) -> Recording:
    """Return half a minute of a tracker's recording [mm], for an axis with 0.8 of the speed that breathing has."""
    layout = CsvLayout(separator=";", decimal=",")
    recorded = (
        read_csv(path, "Timestamp", "ms", {"z": "z"}, layout, _REPAIRS)["z"].select(start, start + 30.0).samples()
    )
    samples = Samples(recorded.times[::every] - start, recorded.values[::every])
    low, high = np.min(samples.values), np.max(samples.values)
    smooth = np.convolve(recorded.values, np.ones(5) / 5, "valid")
    fastest = 0.8 * float(np.max(np.abs(np.diff(smooth) / np.diff(recorded.times[2:-2]))))
    bounds = Bounds(Interval(float(low) - 1.0, float(high) + 1.0), Interval(-fastest, fastest), Interval(-40.0, 40.0))
    name = f"breathing, {path.stem} from {start:g} s"
    return Recording(name, samples, _axis_of_robot(bounds), (0.0, float(samples.times[-1])), bounds, 0.02, 1e-5)


def axis() -> Recording:
    """Return the axis of the guide, which was moved by hand [m]."""
    bounds = Bounds(Interval(-0.10, 0.10), Interval(-0.09, 0.09), Interval(-0.3, 0.3))
    (samples,) = sampled_by(experiment("axis")).samples
    return Recording(
        "axis", Samples(samples.times, samples.values), _axis_of_robot(bounds), "all_times", bounds, 0.01, 1e-6
    )


def drive_cycle() -> Recording:
    """Return a hill of the Urban Dynamometer Driving Schedule [m/s]."""
    bounds = Bounds(Interval(-0.05, 16.3), Interval(-1.5, 1.5))
    (samples,) = sampled_by(experiment("drive-cycle")).samples
    of = Samples(samples.times - samples.times[0], samples.values)
    window = (0.0, float(of.times[-1]))
    return Recording("drive cycle", of, _integrator(bounds, 0.2), window, bounds, 0.1, 0.1)


def recordings(paths: Iterable[Path] = ()) -> Iterator[Recording]:
    """Return all recordings, and those of other files."""
    yield axis()
    yield drive_cycle()
    for path in (ROOT / "data" / "recordings" / "breathing.csv", *paths):
        yield from (breathing(path, start) for start in (0.0, 60.0))
    yield from (made_up(level) for level in LEVELS)


def rows(paths: Iterable[Path] = ()) -> Iterator[Row]:
    """Yield misfits of signals whose mean is known, and errors at samples that were left out."""
    for recording in recordings(paths):
        programs = recording.held_out_by_programs()
        for name, kernel in KERNELS.items():
            if recording.mean is not None:
                yield _misfit(recording, name, kernel())
            yield _held_out(recording, name, kernel(), min(programs.values()))


def _misfit(recording: Recording, name: str, kernel: Kernel) -> Row:
    problem, rival = f"{recording.name}, {name}: misfit", "its mean given"
    try:
        learned = recording.learned(kernel), recording.learned(kernel, mean=recording.mean)
        own, given = map(recording.misfit, learned)
    except FAILURES as why:
        return Row.failed(_TOPIC, problem, rival, why)
    return _row(problem, rival, own, given, MISFIT)


def _held_out(recording: Recording, name: str, kernel: Kernel, best: float) -> Row:
    problem, rival = f"{recording.name}, {name}: error at samples left out", "the best of three quadratic programs"
    try:
        own = recording.held_out(kernel)
    except FAILURES as why:
        return Row.failed(_TOPIC, problem, rival, why)
    return _row(problem, rival, own, best, HELD_OUT if name in recording.kernels else None)


def _row(problem: str, rival: str, own: float, other: float, target: float | None) -> Row:
    ratio = own / other
    note = f"{own:.4g} beside {other:.4g}"
    return Row(_TOPIC, problem, rival, *_NO_TIMES, ratio, ratio, ratio, target, at_most=True, note=note)


def _root_mean_square(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    for row in rows(map(Path, sys.argv[1:])):
        print(
            f"{row.problem}, beside {row.rival}: {row.failure or f'{row.ratio:.3f} {row.verdict}'} ({row.note})",
            flush=True,
        )
