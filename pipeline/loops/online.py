"""Learn references again while the loop runs, from samples that are drawn or were held out.

The loop tracks a new reference only if all guarantees of the loop remain valid.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pipeline.experiments import Experiment
from pipeline.experiments.fields import Relearning
from pipeline.loops.trajectory import Course
from pipeline.storage.archive import Sampled
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.claim import times_of
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.control.controller import Controller
from trackably.control.simulation import ClosedLoop, simulate
from trackably.control.stepping import Infeasible, Plan
from trackably.errors import InputError, NoReferenceError
from trackably.gp.samples import Samples
from trackably.learning.learner import JOINT
from trackably.learning.problem import ConstrainedProblem
from trackably.streams.relearner import LearningResult, holds_for_all_times
from trackably.systems.reference import Reference
from trackably.systems.sampling import sampled_signals


def receding_window(samples: tuple[Samples, ...], until: float, count: int) -> tuple[Samples, ...]:
    """Return the last `count` samples of each flat output up to the time `until` [s].

    Raises ValueError if a flat output has no sample up to this time.
    """
    found = []
    for of in samples:
        last = np.flatnonzero(of.times <= until)[-count:]
        if not last.size:
            raise ValueError(f"online: no sample has arrived by {until:g} s, the first comes at {of.times[0]:g} s")
        found.append(of.only(last))
    return tuple(found)


@dataclass(frozen=True)
class ReferenceUpdate:
    """A reference learned at a `step`, and whether it was `taken`: the controller tracks it from then on.

    `samples` are the numbers of samples of each flat output. `reason` says why the reference was taken or not. If there
    is no plan, `widening` is the least part of their widths by which the sets would have to be widened for a plan.
    """

    step: int
    samples: tuple[int, ...]
    taken: bool
    widening: float | None
    reason: str


@dataclass(frozen=True, eq=False)
class OnlineLoop:
    """A closed loop along changing references, all updates in order, and the `reference` at the end."""

    loop: ClosedLoop
    updates: tuple[ReferenceUpdate, ...]
    reference: Reference

    @property
    def offers(self) -> Course:
        """Return for each update whether it was `taken` (1 or 0), and the `widening`; NaN without a widening."""
        rows = np.array([(o.step, o.taken, o.widening) for o in self.updates], dtype=float).reshape(-1, 3)
        steps, taken, widening = rows.T
        return Course(steps, {"taken": taken, "widening": widening})


def simulate_online(
    controller: Controller,
    first: Certified,
    initial_state: ArrayLike,
    steps: int,
    arrivals: Iterable[tuple[int, tuple[Samples, ...]]],
    learner: Callable[[tuple[Samples, ...]], LearningResult],
) -> OnlineLoop:
    """Simulate the closed loop from `initial_state` (n,) at step 0, and learn the reference again at each arrival.

    The loop begins on the reference `first`, which is certified for all times. An arrival is (k, samples): a step, in
    increasing order, and the samples of the window that ends there (`receding_window`). Since the current reference is
    certified for all times, the loop can stay on it if a new one is not taken.
    """
    now, state, reference = 0, np.asarray(initial_state, dtype=float), first.reference
    parts: list[ClosedLoop] = []
    updates: list[ReferenceUpdate] = []
    for k, samples in arrivals:
        parts.append(simulate(controller, reference, state, k - now, first_step=now))
        if parts[-1].without_plan:
            break
        now, state = k, parts[-1].states[-1]
        learned = learner(samples)
        updates.append(decide_update(controller, k, state, samples, learned))
        if updates[-1].taken and isinstance(learned, Certified):
            reference = learned.reference
    else:
        parts.append(simulate(controller, reference, state, steps - now, first_step=now))
    return OnlineLoop(concatenate(parts), tuple(updates), reference)


def decide_update(
    controller: Controller, k: int, state: Array, samples: tuple[Samples, ...], learned: LearningResult
) -> ReferenceUpdate:
    """Decide whether the controller may track a learned reference from `state` (n,) at step `k` on."""
    taken, widening = False, None
    if not isinstance(learned, Certified):
        why = "learned, but not proved" if isinstance(learned, Counterexample | Unproved) else "no solution"
        reason = f"{why}: {learned.explanation}"
    elif not holds_for_all_times(learned):
        reason = f"proved for {times_of(learned.certificate.claim)} only"
    else:
        result = controller.step(k, state, learned.reference)
        taken, reason = isinstance(result, Plan), result.explanation
        if isinstance(result, Infeasible):
            widening = result.widening
        # The tolerance allows for rounding on a reference that is tracked already; plans on a new one must keep bounds.
        elif isinstance(result, Plan) and not result.keeps_sets:
            taken, reason, widening = False, f"within the tolerance only: {reason}", -result.slack
    return ReferenceUpdate(k, tuple(map(len, samples)), taken, widening, reason)


def concatenate(loops: Sequence[ClosedLoop]) -> ClosedLoop:
    """Join loops that follow each other, each starting at the last state of the one before.

    If the reference changes between two loops, the cost may rise there; `reference_states` at this step are those of
    the new reference.
    """

    def joined(name: str) -> Array:
        parts = [getattr(loop, name) for loop in loops]
        with_ends = name.endswith("states")  # the last state of a loop is the first state of the next loop
        return np.concatenate([*(part[: -1 if with_ends else None] for part in parts[:-1]), parts[-1]])

    return ClosedLoop(
        first_step=loops[0].first_step,
        results=tuple(result for loop in loops for result in loop.results),
        **{name: joined(name) for name in ("states", "inputs", "reference_states", "reference_inputs")},
    )


_AFTERWARDS = 50


def relearn(experiment: Experiment, sampled: Sampled, controller: Controller) -> OnlineLoop | None:
    """Run the loop from the first certified reference on; return None if the experiment does not ask for it.

    Raises InputError if no samples arrive, and NoReferenceError if the first reference is not certified for all
    times. If it is certified, the loop can stay on it whenever a new reference is refused.
    """
    wanted = experiment.control.online
    if wanted is None:
        return None
    stream = _stream(experiment, wanted, sampled)

    def learner(samples: tuple[Samples, ...]) -> LearningResult:
        problem = ConstrainedProblem(samples, experiment.learned_prior, experiment.search_space(samples))
        return learn_certified(problem, experiment.plant, experiment.goal(samples), learner=JOINT)

    sampling_time = experiment.plant.sampling_time
    begin, end = (round(max(float(s.times[-1]) for s in parts) / sampling_time) for parts in (sampled.samples, stream))
    known = sampled.samples
    if wanted.first is not None:
        begin, known = wanted.first, receding_window(stream, wanted.first * sampling_time, wanted.window)
    first = learner(known)
    if not isinstance(first, Certified) or not holds_for_all_times(first):
        why = (first.certificate if isinstance(first, Certified) else first).explanation
        raise NoReferenceError(f"experiment {experiment.name}, control.online: {why}")
    arrivals = [
        (k, receding_window(stream, k * sampling_time, wanted.window))
        for k in range(begin + wanted.every, end + 1, wanted.every)
    ]
    start = first.reference.window(0, 1).states[0]
    return simulate_online(controller, first, start, end + _AFTERWARDS, arrivals, learner)


def _stream(experiment: Experiment, wanted: Relearning, sampled: Sampled) -> tuple[Samples, ...]:
    """Return the first samples of every signal together with the samples that arrive while the loop runs."""
    later = dict(sampled.held_out)
    if (stream := wanted.stream) is not None:
        step = experiment.plant.sampling_time
        later |= {name: stream.samples(truth, step) for name, truth in experiment.truths.items()}
    if missing := sampled.by_name.keys() - later.keys():
        raise InputError(
            f"experiment {experiment.name}: control.online: no samples of {', '.join(sorted(missing))} arrive; give a "
            "stream where the ground truth is known, or hold some out of a recording"
        )
    arriving = experiment.measured({name: later[name] for name in sampled.by_name}).all
    joined = {name: _joined(first, arriving[name]) for name, first in sampled.by_name.items()}
    return sampled_signals(experiment.plant, joined)


def _joined(first: Samples, later: Samples) -> Samples:
    new, parts = later.times > first.times[-1], ("times", "values", "relative_noise")
    times, values, noise = (np.concatenate([getattr(first, name), getattr(later, name)[new]]) for name in parts)
    return Samples(times, values, noise, first.stencil, first.scatters)
