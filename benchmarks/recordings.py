"""Errors and times of references under bounds that recordings break.

- Bounds that are active for long: learning with proof, beside the likeliest function on a fine grid for the same θ.
- Nonlinear plants: there is no such program, so their times are compared with 10 s.
- Function and hyperparameters learned together, beside hyperparameters θ alone.
- Defaults: `learn_reference` gets only samples, a plant, a kernel and a claim. Without a prior mean, the misfit has to
  be at most 1.05 times that with the true mean, for synthetic signals far from zero. The middle one of every five
  samples is left out, and the error at these samples has to be at most 1.1 times that of the best of three quadratic
  programs, whose smoothness weights are a decade apart. The best one is chosen by the samples that are left out, so
  that no rule for choosing a weight can be better.
"""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from benchmarks.harness import ROOT, Row, attempted, duel, part_of, timed, within
from benchmarks.problems import BREATHING, NOISE, Task, box, irregular, misfit, task, tracked
from benchmarks.programs import likeliest, smoothed
from pipeline.published.ground_truth import GroundTruth, docking_y, setpoint_change
from trackably import Periodic, TrackableReference, learn_reference
from trackably.arrays import Array, root_mean_square
from trackably.certificates.certified import Certified
from trackably.checker.certificate import AllTimes, Window
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.learner import FUNCTION, HYPERPARAMETERS, JOINT
from trackably.systems.constrained import ConstrainedSystem, System
from trackably.systems.intervals import Interval
from trackably.systems.library import kinematic_bicycle, mobile_robot, tank
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

KERNELS: dict[str, Callable[[], Kernel]] = {
    "squared exponential": SquaredExponential,
    "Matérn 3/2": Matern32,
    "Matérn 5/2": Matern52,
}
ALONE, _ACTIVE = "θ alone", "active bounds"


def rows() -> Iterator[Row]:
    """Yield the rows of all comparisons of this module."""
    for kernel in KERNELS:
        for of in problems():
            name = f"{of.name}, {len(of.samples)} samples, {kernel}"
            yield from attempted(_ACTIVE, name, "program on a fine grid", partial(_beside_program, of, kernel, name))
    yield from _bending()
    yield from _jointly()
    for recording in recordings():
        best = recording.held_out_by_programs()
        for kernel in KERNELS:
            yield from _defaults(recording, kernel, best)


def around(size: float) -> Interval:
    """Return [−size, size]."""
    return Interval(-size, size)


_FOLDS = 5
_DECADES = 0.1, 1.0, 10.0


@dataclass(frozen=True, eq=False)
class Recording:
    """Samples of a signal with `bounds` of its value and derivatives, by their order; the last one is the input.

    Programs on a grid have times `step` [s] apart, and the middle one of three programs has the `weight`. The `mean` of
    the signal may be known. References are learned with each of `kernels`: functions of a squared exponential have all
    derivatives, unlike a person's motion.
    """

    name: str
    samples: Samples
    bounds: tuple[Interval, ...]
    sampling_time: float
    step: float = 0.0
    weight: float = 0.0
    kernels: tuple[str, ...] = ("Matérn 5/2",)
    mean: float | None = None
    forever: bool = False

    @property
    def plant(self) -> ConstrainedSystem:
        """Return the chain of integrators from the input to the signal."""
        *states, inputs = ([of.lower, of.upper] for of in self.bounds)
        n = len(states)
        system = LinearSystem.discretised(np.eye(n, k=1), np.eye(n, 1, k=1 - n), self.sampling_time)
        return ConstrainedSystem(system, Polytope.box(*np.transpose(states)), Polytope.box(*np.transpose([inputs])))

    @property
    def claim(self) -> Window | AllTimes:
        """The claim: the window of the samples, or all times."""
        times = self.samples.times
        return AllTimes() if self.forever else Window(float(times[0]), float(times[-1]))

    def task(self, kernel: str) -> Task:
        """Return the task of learning all hyperparameters except the mean, which is the known one or zero."""
        prior = JointPrior((Prior(KERNELS[kernel](), None, self.mean or 0.0),))
        return Task((self.samples,), prior, self.plant, self.claim, starts=4)

    @property
    def seen(self) -> npt.NDArray[np.bool_]:
        """Flags of the samples that are learned from: all except the middle one of every five."""
        return np.asarray(np.arange(len(self.samples)) % _FOLDS != _FOLDS // 2)

    @property
    def parts(self) -> tuple[Samples, Samples]:
        """The samples that are learned from, and those left out."""
        return self.samples.only(self.seen), self.samples.only(~self.seen)

    def learned(self, samples: Samples, kernel: Kernel, **options: Any) -> TrackableReference:
        """Return a reference learned from all samples, or from a part of them."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return learn_reference(samples, self.plant, kernel, self.claim, progress=False, **options)

    def held_out_by_programs(self) -> float:
        """Return the error at the samples left out of the best of three quadratic programs."""
        found = (smoothed(self.samples, self.bounds, self.step, by * self.weight, self.seen) for by in _DECADES)
        return min(root_mean_square((values - self.samples.values)[~self.seen]) for values in found)


def distance(found: TrackableReference, samples: Samples) -> float:
    """Return the root mean square of reference minus samples."""
    return root_mean_square(found.reference.state_at(samples.times)[:, 0] - samples.values)


_ON_BOUNDS = 0.7  # part of the time at which the speed is on its bounds


def problems() -> Iterator[Recording]:
    """Return drive cycles, breathing with less speed than recorded, and signals whose input is on its bounds.

    The longer drive cycle is the first 1800 s of FTP-75: the urban schedule, and then its beginning again.
    """
    table = np.loadtxt(ROOT / "benchmarks/rivals/data/udds.csv", delimiter=",", skiprows=1)
    for name, count, most in (("UDDS", len(table), 1.5), ("drive cycle", 1800, 1.2)):
        speed = Samples(np.arange(float(count)), np.resize(0.44704 * table[:, 1], count))
        yield Recording(name, speed, (Interval(-0.05, 26.0), around(most)), 0.2, mean=8.7)
    for count, speed in ((300, 8.0), (300, 5.0), (1200, 8.0), (1200, 5.0)):
        yield Recording(f"breathing, |v| ≤ {speed:g}", _breathing(count), (around(20.0), around(speed)), 0.01)
    yield from map(on_bounds, (100, 300, 1000, 3000))


def _breathing(count: int) -> Samples:
    """Return half a minute of breathing at regular times, interpolated by splines from nearly regular samples."""
    recorded, times = tracked(), np.arange(count) * (30.0 / count)
    values = recorded.values - np.median(recorded.values)
    noise = 0.02 * np.random.default_rng(count).standard_normal(count)
    return Samples(times, scipy.interpolate.PchipInterpolator(recorded.times, values)(times) + noise)


def sines(draws: np.random.Generator, periods: Array, sizes: Array) -> Callable[[Array, int], Array]:
    """Return derivatives of a sum of sines with random phases, as a function of time [s] and order."""
    omega, phases = 2 * np.pi / periods, draws.uniform(0, 2 * np.pi, len(periods))
    return lambda t, order: np.sin(np.outer(t, omega) + phases + order * np.pi / 2) @ (sizes * omega**order)


def on_bounds(count: int) -> Recording:
    """Return noisy samples of a sum of sines whose speed is cut off, so that it is on its bounds most of the time."""
    draws, apart, fine = np.random.default_rng(0), 0.1, 0.01
    t = fine * np.arange(round(count * apart / fine) + 1)
    speed = sines(draws, np.array([7.3, 4.1, 2.6]), np.array([1.0, 0.7, 0.4]))(t, 1)
    fastest = float(np.quantile(np.abs(speed), 1 - _ON_BOUNDS))
    position = fine * np.cumsum(np.clip(speed, -fastest, fastest))
    position -= np.linspace(0.0, position[-1], len(position))
    times = apart * np.arange(count)
    noise = 0.02 * np.std(position) * draws.standard_normal(count)
    samples, width = Samples(times, np.interp(times, t, position) + noise), 3 * float(np.ptp(position))
    return Recording("axis on its bounds", samples, (around(width), around(fastest)), fine)


_GIVEN, _LEARNED, _MISFIT = 3.0, 10.0, 1.05  # targets, as multiples of the program's time and misfit


def _beside_program(recording: Recording, kernel: str, name: str) -> Iterator[Row]:
    """Yield rows with our times, learning θ and for given θ, beside the program's time, and with both misfits."""
    task, rival = recording.task(kernel), "program for this θ"
    joint, taken = timed(partial(task.learned, JOINT))
    known = task.with_known(joint.solution.posterior.prior)
    given, taken_given = timed(partial(known.learned, FUNCTION))
    own, active = misfit(given), len(given.solution.active_bounds)
    beside = likeliest(recording.samples, known.prior.parts[0], recording.bounds)
    told = f"J = {joint.solution.objective:.6g}, back-off {joint.backoff:.1g}, {active} bounds active"
    for what, seconds, target in (("θ learned", taken, _LEARNED), ("θ given", taken_given, _GIVEN)):
        yield part_of(_ACTIVE, f"{name}: {what}", rival, seconds, beside.seconds, target, told, in_seconds=True)
    yield part_of(_ACTIVE, f"{name}: misfit", rival, own, beside.misfit, _MISFIT, f"{own:.4g}")


_SECONDS = 10.0
_NOT_SLOWER = 1.1  # target, as a multiple of the misfit of a robot that may stop


def bending() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield nonlinear problems, as names and arguments of `learn_reference`: robots, an eight, a bicycle, a tank."""
    draws = np.random.default_rng(0)
    t, filled, at = np.arange(0.0, 8.01, 0.2), np.linspace(0.0, 16.0, 40), np.arange(48) / 4

    def noisy(times: Array, noise: float, **paths: Array) -> dict[str, Samples]:
        return {name: Samples(times, path + noise * draws.standard_normal(len(times))) for name, path in paths.items()}

    def planar(system: System, low: list[float], high: list[float], inputs: Polytope) -> ConstrainedSystem:
        any_heading = float("inf")
        return ConstrainedSystem(system, Polytope.box([*low, -any_heading], [*high, any_heading]), inputs)

    driven = mobile_robot(0.1)
    corridor = noisy(t, 0.02, x=4 * _eased((t - 0.5) / 7), y=0.5 * np.sin(1.5 * np.pi * _eased((t - 0.5) / 7)))
    known = {"kernel": SquaredExponential(), "noise_std": 0.02, "claim": (0.0, 8.0)}
    for slowest in (0.0, 0.05):
        plant = planar(driven, [-1.0, -0.4], [5.0, 0.4], Polytope.box([slowest, -1.5], [0.9, 1.5]))
        yield f"robot that stops, v ≥ {slowest:g}", {"samples": corridor, "plant": plant, **known}
    eight = noisy(at, 0.03, x=2 * np.sin(np.pi * at / 6), y=1.2 * np.sin(np.pi * at / 3))
    plant = planar(driven, [-1.9, -1.1], [1.9, 1.1], Polytope.box([0.3, -1.6], [1.5, 1.6]))
    of_eight = {"kernel": Periodic(period=12.0), "noise_std": 0.03, "claim": "all_phases", "mean": 0.0}
    yield "eight of 2 × 48 samples", {"samples": eight, "plant": plant, **of_eight}
    swerve = noisy(t, 0.02, x=t, y=1.5 * _eased((t - 1) / 5))
    plant = planar(kinematic_bicycle(0.1, 0.5), [-1.0, -0.1], [10.0, 1.6], Polytope.box([0.5, -0.2], [1.15, 0.2]))
    yield "bicycle", {"samples": swerve, "plant": plant, **known}
    plant = ConstrainedSystem(tank(0.1, 1.0, 0.1), Polytope.box([0.5], [1.35]), Polytope.box([0.0], [0.25]))
    levels = noisy(filled, 0.02, level=1.2 + 0.25 * np.sin(filled))
    yield "tank", {"samples": levels, "plant": plant, **known, "claim": (0.0, 16.0), "mean": 1.0}


def _eased(part: Array) -> Array:
    """Return a motion from 0 to 1 with the least jerk."""
    part = np.clip(part, 0.0, 1.0)
    return np.asarray(10 * part**3 - 15 * part**4 + 6 * part**5)


def _bending() -> Iterator[Row]:
    """Yield rows with times of nonlinear problems beside 10 s, and misfits of robots that must move or may stop."""
    misfits = []

    def learned(name: str, given: dict[str, Any]) -> Iterator[Row]:
        found, taken = timed(partial(learn_reference, **given, starts=4, progress=False))
        misfits.extend([float(np.hypot.reduce(list(found.misfit.values())))] if name.startswith("robot") else [])
        told = f"J = {found.objective:.6g}, gap {found.duality_gap:.2g}, starts differ by {found.fit.spread:.2g}"
        yield within(_ACTIVE, name, taken, _SECONDS, told)

    for name, given in bending():
        yield from attempted(_ACTIVE, name, f"{_SECONDS:g} s", partial(learned, name, given))
    if len(misfits) == 2:
        yield part_of(_ACTIVE, "robot that stops: misfit, v ≥ 0.05", "v ≥ 0", *misfits[::-1], _NOT_SLOWER)


_TIME, _OFF, _ERROR = (f"learned jointly: {what}" for what in ("time with proof", "misfit", "error"))


def _jointly() -> Iterator[Row]:
    """Yield rows with times of joint learning, and with misfits and errors beside those of learning θ alone."""
    for name, rounds in (("Example 1", 9), ("Example 2", 5)):
        of = task(name.lower().replace(" ", ""))
        ours, theirs = (partial(of.learned, learner) for learner in (JOINT, HYPERPARAMETERS))
        yield duel(_TIME, name, ALONE, ours, theirs, rounds=rounds, target=3.0, at_most=True)
    system = LinearSystem.scalar(0.9, 0.5, sampling_time=0.01)
    cut = ConstrainedSystem(system, Polytope.box([-1.5], [0.9]), box([1.0]))  # the bound cuts off the crests of a sine
    many = irregular(1000)
    prior, window = JointPrior((Prior(SquaredExponential(), NOISE),)), Window(0.0, float(many.times[-1]))
    found, taken = timed(Task((many,), prior, cut, window, starts=4).learned)
    note = f"{len(found.solution.active_bounds)} bounds active; {_told(found)}"
    yield within(_TIME, "n = 1 000 at random times", taken, 10.0, note)
    for name, of, target in (
        ("guide's axis", task("axis"), 0.5),
        ("Example 2", task("example2"), 0.5),
        ("tank", task("tank"), None),
    ):
        yield _compared(_OFF, name, of, target, misfit)
    for name, of, process, truth, last, target in (
        ("Example 1, x ≤ 0.002", task("example1", 0.002), 0, setpoint_change, 200, 0.2),
        ("vehicle, y", task("vehicle"), 1, docking_y, 240, 0.4),
    ):
        yield _compared(_ERROR, name, of, target, partial(_error, of, process, truth, last))


def _compared(topic: str, name: str, of: Task, target: float | None, off: Callable[[Certified], float]) -> Row:
    """Return a row that compares the distance `off` of joint learning and of θ alone; its note has J and the price."""
    both = [of.learned(learner) for learner in (JOINT, HYPERPARAMETERS)]
    joint, alone = map(off, both)
    note = " beside ".join(f"{off(found):.3g}, {_told(found)}" for found in both)
    return part_of(topic, name, ALONE, joint, alone, target, note)


def _error(of: Task, process: int, truth: GroundTruth, last_step: int, found: Certified) -> float:
    """Return the root mean square error of a flat output to the truth, at the plant's steps."""
    times = np.arange(last_step + 1.0) * of.plant.sampling_time
    stencil = of.samples[process].stencil
    return root_mean_square(stencil.measured(found.solution.signals[process], times) - truth(times))


def _told(found: Certified) -> str:
    bounds = f" with D = {found.solution.price:.3g}" if found.solution.active_bounds else ""
    return f"J = {found.solution.objective:.5g}{bounds}, misfit {misfit(found):.3g}"


MISFIT, HELD_OUT = 1.05, 1.1
LEVELS = 293.15, 80.0, -1200.0
_PROGRAMS = "the best of three quadratic programs"


def made_up(level: float) -> Recording:
    """Return noisy samples of three sines about a level, with bounds on value and speed; the speed breaks its bound."""
    draws, count = np.random.default_rng(0), 80
    times = 0.15 * np.arange(count) + draws.uniform(-0.03, 0.03, count)
    signal = sines(draws, np.array([6.3, 3.1, 1.9]), np.array([10.0, 5.0, 2.5]))
    samples = Samples(times, level + signal(times, 0) + 0.8 * draws.standard_normal(count))
    fastest = 0.8 * float(np.max(np.abs(signal(np.linspace(0, 0.15 * count, 4000), 1))))
    bounds, kernels = (Interval(level - 22.0, level + 22.0), around(fastest)), tuple(KERNELS)
    return Recording(f"made up about {level:g}", samples, bounds, 0.05, 0.025, 1e-4, kernels, level)


def breathing(start: float) -> Recording:
    """Return half a minute of a tracker's recording [mm], for an axis that allows 0.8 of the breathing's speed."""
    recorded = tracked(start)
    samples = Samples(recorded.times - start, recorded.values)
    smooth = np.convolve(recorded.values, np.ones(5) / 5, "valid")
    fastest = 0.8 * float(np.max(np.abs(np.diff(smooth) / np.diff(recorded.times[2:-2]))))
    low, high = float(np.min(samples.values)), float(np.max(samples.values))
    bounds = Interval(low - 1.0, high + 1.0), around(fastest), around(40.0)
    return Recording(f"breathing, {BREATHING.stem} from {start:g} s", samples, bounds, 0.01, 0.02, 1e-5)


def axis() -> Recording:
    """Return the axis of the guide, which was moved by hand [m]."""
    return replace(_of_experiment("axis", 0.01, 0.01, 1e-6), forever=True)


def hill() -> Recording:
    """Return a hill of the Urban Dynamometer Driving Schedule [m/s]."""
    return replace(_of_experiment("drive-cycle", 0.2, 0.1, 0.1), name="drive cycle")


def _of_experiment(name: str, *programs: float) -> Recording:
    of = task(name)
    (samples,), sets = of.samples, (of.plant.state_set, of.plant.input_set)
    bounds = tuple(interval for bounded in sets for interval in bounded.bounds)
    return Recording(name, Samples(samples.times - samples.times[0], samples.values), bounds, *programs)


def recordings() -> Iterator[Recording]:
    """Return all recordings."""
    yield axis()
    yield hill()
    yield from map(breathing, (0.0, 60.0))
    yield from map(made_up, LEVELS)


def _defaults(recording: Recording, name: str, best: float) -> Iterator[Row]:
    """Yield rows with misfits of signals whose mean is known, and with errors at samples that are left out."""
    of, (part, left_out), kernel = recording.samples, recording.parts, KERNELS[name]()

    def misfits() -> tuple[float, float]:
        without, given = recording.learned(of, kernel), recording.learned(of, kernel, mean=recording.mean)
        return distance(without, of), distance(given, of)

    def errors() -> tuple[float, float]:
        return distance(recording.learned(part, kernel), left_out), best

    if recording.mean is not None:
        yield from _compared_defaults(f"{recording.name}, {name}: misfit", "its mean given", misfits, MISFIT)
    target = HELD_OUT if name in recording.kernels else None
    yield from _compared_defaults(f"{recording.name}, {name}: error at samples left out", _PROGRAMS, errors, target)


def _compared_defaults(
    problem: str, rival: str, numbers: Callable[[], tuple[float, float]], target: float | None
) -> Iterator[Row]:
    def rows() -> Iterator[Row]:
        own, other = numbers()
        yield part_of(*place, own, other, target, f"{own:.4g} beside {other:.4g}")

    place = "defaults alone", problem, rival
    return attempted(*place, rows)
