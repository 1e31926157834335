"""A loop along references that are learned while it runs: a new one is accepted only if it keeps every guarantee."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array, ArrayLike
from trackably.certificates.certified import Certified
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.control.controller import Controller
from trackably.control.online import BudgetExceeded, LearnFromWindow, LearningResult, holds_for_all_times
from trackably.control.simulation import ClosedLoop, simulate
from trackably.control.stepping import Infeasible, Unsolved
from trackably.gp.samples import Samples
from trackably.systems.reference import Reference


def receding_window(samples: tuple[Samples, ...], until: float, count: int) -> tuple[Samples, ...]:
    """Return the last `count` samples of each flat output up to the time `until` [s].

    Raises ValueError where there is none.
    """
    return tuple(_last(s, until, count) for s in samples)


def _last(samples: Samples, until: float, count: int) -> Samples:
    arrived = np.flatnonzero(samples.times <= until)[-count:]
    if not arrived.size:
        raise ValueError(f"online: no sample has arrived by {until:g} s, the first comes at {samples.times[0]:g} s")
    stencil = samples.stencil.only(arrived)
    return Samples(samples.times[arrived], samples.values[arrived], samples.relative_noise[arrived], stencil)


@dataclass(frozen=True)
class ReferenceUpdate:
    """A reference learned at step `k`, and whether the controller tracks it from then on.

    `sample_counts` are the numbers of samples of each flat output. `reason` says why the reference was `accepted` or
    not. `widening` is the least part of their widths by which the sets would have to be widened for a plan, where that
    is the reason.
    """

    k: int
    sample_counts: tuple[int, ...]
    learned: LearningResult
    accepted: bool
    reason: str
    widening: float | None = None


@dataclass(frozen=True, eq=False)
class OnlineLoop:
    """A closed loop along changing references, all updates in order, and the `reference` at the end."""

    loop: ClosedLoop
    updates: tuple[ReferenceUpdate, ...]
    reference: Reference


def simulate_online(
    controller: Controller,
    first: Certified,
    initial_state: ArrayLike,
    steps: int,
    arrivals: Iterable[tuple[int, tuple[Samples, ...]]],
    learner: LearnFromWindow,
) -> OnlineLoop:
    """Simulate the closed loop from `initial_state` (n,) at step 0, and learn the reference again at each arrival.

    The loop begins on the reference `first`. An arrival is (k, samples): a step, in increasing order, and the samples
    of the window that ends there (`receding_window`). Since the current reference is certified for all times, nothing
    is lost where a new one is not accepted. Raises ValueError where `first` is certified for less, and where arrivals
    are not in increasing order within `steps`.
    """
    if not holds_for_all_times(first):
        raise ValueError(
            f"online: the first reference must be certified for all time, but only for {first.certificate.claim}"
        )
    now, state, reference = 0, np.asarray(initial_state, dtype=float), first.reference
    parts: list[ClosedLoop] = []
    updates: list[ReferenceUpdate] = []
    for k, samples in arrivals:
        if not now <= k <= steps or (updates and k == now):
            raise ValueError(
                f"online: arrivals must come in increasing order and within {steps} steps, got {k} after {now}"
            )
        parts.append(simulate(controller, reference, state, k - now, first_step=now))
        if parts[-1].without_plan:
            return OnlineLoop(concatenate(parts), tuple(updates), reference)
        now, state = k, parts[-1].states[-1]
        learned = learner(samples)
        updates.append(decide_update(controller, k, state, samples, learned))
        if updates[-1].accepted and isinstance(learned, Certified):
            reference = learned.reference
    parts.append(simulate(controller, reference, state, steps - now, first_step=now))
    return OnlineLoop(concatenate(parts), tuple(updates), reference)


def decide_update(
    controller: Controller, k: int, state: Array, samples: tuple[Samples, ...], learned: LearningResult
) -> ReferenceUpdate:
    """Decide whether the controller may track a learned reference from `state` (n,) at step `k` on."""
    counts = tuple(len(s) for s in samples)
    if not isinstance(learned, Certified):
        why = "learned, but not proved" if isinstance(learned, Counterexample | Unproved) else "no solution"
        why = "not ready" if isinstance(learned, BudgetExceeded) else why
        return ReferenceUpdate(k, counts, learned, False, f"{why}: {learned.explanation}")
    if not holds_for_all_times(learned):
        return ReferenceUpdate(k, counts, learned, False, f"proved for {learned.certificate.claim} only")
    result = controller.step(k, state, learned.reference)
    if isinstance(result, Infeasible):
        return ReferenceUpdate(k, counts, learned, False, result.explanation, result.widening)
    if isinstance(result, Unsolved):
        return ReferenceUpdate(k, counts, learned, False, result.explanation)
    # The tolerance makes up for rounding on the reference that is tracked already. A new one must not need it.
    if not result.keeps_sets:
        reason = f"within the tolerance only: {result.explanation}"
        return ReferenceUpdate(k, counts, learned, False, reason, -result.slack)
    return ReferenceUpdate(k, counts, learned, True, result.explanation)


def concatenate(loops: Sequence[ClosedLoop]) -> ClosedLoop:
    """Join loops that follow each other, each starting at the last state of the one before.

    Where the reference changes between two loops the cost may rise; `reference_states` at that step are those of the
    new reference.
    """

    def values(of: Callable[[ClosedLoop], Array]) -> Array:
        return np.concatenate([of(loop) for loop in loops])

    def states(of: Callable[[ClosedLoop], Array]) -> Array:
        return np.concatenate([*(of(loop)[:-1] for loop in loops), of(loops[-1])[-1:]])

    return ClosedLoop(
        first_step=loops[0].first_step,
        states=states(lambda loop: loop.states),
        inputs=values(lambda loop: loop.inputs),
        reference_states=states(lambda loop: loop.reference_states),
        reference_inputs=values(lambda loop: loop.reference_inputs),
        costs=values(lambda loop: loop.costs),
        stage_costs=values(lambda loop: loop.stage_costs),
        slacks=values(lambda loop: loop.slacks),
        without_plan=tuple(result for loop in loops for result in loop.without_plan),
        widened=sum(loop.widened for loop in loops),
    )
