"""Function and hyperparameters learned together, beside θ alone: times with proofs, misfits and errors."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from time import process_time

import numpy as np

from benchmarks.duel import Row, duel
from benchmarks.learned import Task, misfit, task
from benchmarks.machine import ROOT
from benchmarks.problems import NOISE, irregular
from pipeline.published.ground_truth import GroundTruth, docking_y, draw, setpoint_change
from trackably.certificates.certified import Certified
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.learner import HYPERPARAMETERS, JOINT
from trackably.learning.prior import prior_for
from trackably.recordings import Column, CsvLayout, read_csv
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.sampling import sampled_signals

ALONE = "θ alone"
_TIME, _MISFIT, _ERROR = (f"learned jointly: {what}" for what in ("time with proof", "misfit", "error"))
_DRAWS, _COLLAPSED = 10, 5.0  # a misfit of so many σ_n is a collapse


def rows() -> Iterator[Row]:
    """Times of both examples; the paper's problems, the guide's axis, vehicle, robot axis and tank; many samples."""
    for name, rounds in (("Example 1", 9), ("Example 2", 5)):
        both = task(name.lower().replace(" ", ""))
        yield duel(
            _TIME,
            name,
            ALONE,
            partial(both.learned, JOINT),
            partial(both.learned, HYPERPARAMETERS),
            rounds=rounds,
            target=3.0,
            at_most=True,
        )
    yield _many()
    yield _misfits("guide's axis", axis(), 0.5, _drift)
    yield _misfits("Example 2, seed 4", task("example2"), 0.5)
    yield _misfits("tank", task("tank"))
    tight = task("example1").with_upper_state_bound(0.002)
    yield _errors("Example 1, x ≤ 0.002", tight, 0, setpoint_change, 200, 0.2)
    yield _errors("vehicle, y", task("vehicle"), 1, docking_y, 240, 0.4)
    yield _collapsed()


def _many() -> Row:
    """A thousand samples of a sine whose crests are cut off."""
    system = LinearSystem.scalar(0.9, 0.5, sampling_time=0.01)
    plant = ConstrainedSystem(system, Polytope.box([-1.5], [0.9]), Polytope.box([-1.0], [1.0]))
    prior = JointPrior((Prior(SquaredExponential(), NOISE),))
    samples = irregular(1000)
    cut = Task((samples,), prior, plant, (0.0, float(samples.times[-1])), starts=4)
    before = process_time()
    found = cut.learned(JOINT)
    taken = process_time() - before
    note = f"{len(found.solution.active_bounds)} bounds active; {_told(found, (samples,))}"
    part = (taken / 10,) * 3
    return Row(_TIME, "n = 1 000 at random times", "ten seconds", taken, 10.0, *part, 1.0, at_most=True, note=note)


def axis() -> Task:
    """Return the problem of the guide (notebooks/guide.ipynb)."""
    signals = {"position": Column("position [mm]", scale=1e-3)}
    table, layout = ROOT / "data" / "recordings" / "axis.csv", CsvLayout(decimal=",")
    samples = read_csv(table, "time [ms]", "ms", signals, layout).samples("position")
    system = LinearSystem.discretised(
        np.array([[0, 1], [0, 0]]),
        np.array([[0], [1]]),
        sampling_time=0.01,
        states=("position", "velocity"),
        inputs=("acceleration",),
    )
    plant = ConstrainedSystem(system, Polytope.box([-0.10, -0.09], [0.10, 0.09]), Polytope.box([-0.3], [0.3]))
    _, seen = sampled_signals(plant, {"position": samples})
    return Task(seen, prior_for(plant, {"position": Prior(SquaredExponential(), None)}), plant, "all_times")


def _drift(found: Certified) -> str:
    """Say how far the axis is from rest after its last sample, in 20 s."""
    position, _, _ = found.reference.quantities
    times = found.solution.posterior.samples[0].times[-1] + np.linspace(0, 20, 20001)
    return f"drift after rest {1e3 * np.max(np.abs(position(found.solution.signals, times))):.3g} mm"


def _misfits(name: str, of: Task, target: float | None = None, say: Callable[[Certified], str] | None = None) -> Row:
    """Compare misfits; the note has J and the price of the bounds."""
    joint, alone = of.learned(JOINT), of.learned(HYPERPARAMETERS)
    told = [f"{_told(found, of.samples)}{f', {say(found)}' if say else ''}" for found in (joint, alone)]
    ratio = misfit(joint, of.samples) / misfit(alone, of.samples)
    return _ratio(_MISFIT, name, ALONE, ratio, target, " beside ".join(told))


def _errors(name: str, of: Task, process: int, truth: GroundTruth, last_step: int, target: float) -> Row:
    """Compare root mean square errors of a flat output to the truth, at the plant's steps."""
    times = np.arange(last_step + 1.0) * of.plant.sampling_time
    stencil = of.samples[process].stencil

    def error(found: Certified) -> float:
        beside = stencil.measured(found.solution.signals[process], times) - truth(times)
        return float(np.sqrt(np.mean(beside**2)))

    joint, alone = of.learned(JOINT), of.learned(HYPERPARAMETERS)
    told = [f"{error(found):.3g}, {_told(found, of.samples)}" for found in (joint, alone)]
    return _ratio(_ERROR, name, ALONE, error(joint) / error(alone), target, " beside ".join(told))


def _collapsed() -> Row:
    """Count the draws of Example 1's samples (its times, its σ_n, seeds 0 to 9) that are missed with x ≤ 0.005."""
    of = task("example1").with_upper_state_bound(0.005)
    noise = of.prior.parts[0].noise_std
    counts, largest = [], []
    for learner in (JOINT, HYPERPARAMETERS):
        drawn = [(draw(setpoint_change, of.samples[0].times, noise, seed),) for seed in range(_DRAWS)]
        misfits = [misfit(replace(of, samples=samples).learned(learner), samples) / noise for samples in drawn]
        counts.append(sum(found > _COLLAPSED for found in misfits))
        largest.append(max(misfits))
    told = f"largest misfits {largest[0]:.2g} and {largest[1]:.2g} σ"
    note = f"collapsed: {counts[0]} of {_DRAWS} beside {counts[1]}; {told}"
    problem = f"Example 1, x ≤ 0.005, {_DRAWS} draws: largest"
    return _ratio(_MISFIT, problem, ALONE, largest[0] / largest[1], _COLLAPSED / largest[1], note)


def _told(found: Certified, samples: tuple[Samples, ...]) -> str:
    solution = found.solution
    bounds = f" with D = {solution.price:.3g}" if solution.active_bounds else ""
    return f"J = {solution.objective:.5g}{bounds}, misfit {misfit(found, samples):.3g}"


def _ratio(topic: str, problem: str, rival: str, ratio: float, target: float | None, note: str) -> Row:
    return Row(topic, problem, rival, np.nan, np.nan, ratio, ratio, ratio, target, at_most=True, note=note)
