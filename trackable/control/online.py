"""Samples arriving while the loop runs: a reference learned anew is followed only if nothing can be lost by it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.certificates.certified import Certified, learn_certified
from trackable.certificates.claim import AllPhases, AllTimes
from trackable.certificates.outcome import Counterexample, Unproved
from trackable.control.controller import Controller
from trackable.control.loop import Loop, joined, simulate
from trackable.control.step.answer import Infeasible, Status
from trackable.gp.joint import JointPrior
from trackable.gp.samples import Samples
from trackable.learning.problem import NoSolution
from trackable.learning.space import SearchSpace
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.reference import Reference

Learned = Certified | NoSolution | Counterexample | Unproved
Learner = Callable[[tuple[Samples, ...]], Learned]
"""From the samples of a window to a reference with a proof, in absolute time, or what stands in the way."""


@dataclass(frozen=True)
class Offer:
    """What became of learning at step `k`, from the `samples` (of each signal) that were there by then.

    `taken` says whether the new reference is followed from k on, and `reason` why. Where the controller would have lost
    feasibility, `widening` is by how much: a part of the sets' widths.
    """

    k: int
    samples: tuple[int, ...]
    learned: Learned
    taken: bool
    reason: str
    widening: float | None = None


@dataclass(frozen=True, eq=False)
class Online:
    """A loop along changing references: what happened, every offer, and the reference at the end."""

    loop: Loop
    offers: tuple[Offer, ...]
    reference: Reference


def simulate_online(
    controller: Controller,
    first: Certified,
    state: Array,
    steps: int,
    arrivals: Iterable[tuple[int, tuple[Samples, ...]]],
    learner: Learner,
) -> Online:
    """The closed loop from `state` (n,) at step 0 on the reference `first`, learned again at each of the `arrivals`.

    These are (k, samples): steps in increasing order, with the samples of the window that ends there (`receding`). As
    the old reference is certified for all time, nothing is lost by an offer that is not taken. Raises ValueError where
    the first reference claims less, or a step does not come after the one before it.
    """
    if not holds_for_ever(first):
        raise ValueError(
            f"online: the first reference must be certified for all time, but only for {first.certificate.claim}"
        )
    at, here, reference = 0, np.asarray(state, dtype=float), first.reference
    parts: list[Loop] = []
    offers: list[Offer] = []
    for k, samples in arrivals:
        if not at <= k <= steps or (offers and k == at):
            raise ValueError(
                f"online: arrivals must come in increasing order and within {steps} steps, got {k} after {at}"
            )
        parts.append(simulate(controller, reference, here, k - at, at))
        if parts[-1].infeasible:
            return Online(joined(parts), tuple(offers), reference)
        at, here = k, parts[-1].states[-1]
        learned = learner(samples)
        offers.append(judged(controller, k, here, samples, learned))
        if offers[-1].taken and isinstance(learned, Certified):
            reference = learned.reference
    parts.append(simulate(controller, reference, here, steps - at, at))
    return Online(joined(parts), tuple(offers), reference)


def judged(controller: Controller, k: int, state: Array, samples: tuple[Samples, ...], learned: Learned) -> Offer:
    """Whether a learned reference may be followed from `state` (n,) at step `k` on."""
    counts = tuple(len(s) for s in samples)
    if not isinstance(learned, Certified):
        unproved = isinstance(learned, Counterexample | Unproved)
        why = "learned, but not proved" if unproved else "no solution"
        return Offer(k, counts, learned, False, f"{why}: {learned.explanation}")
    if not holds_for_ever(learned):
        return Offer(k, counts, learned, False, f"proved for {learned.certificate.claim} only")
    answer = controller.step(k, state, learned.reference)
    if isinstance(answer, Infeasible):
        return Offer(k, counts, learned, False, answer.explanation, answer.widening)
    # On the reference that is followed a tolerance makes up for rounding. There is no reason to start out with it.
    if answer.status is Status.WIDENED:
        return Offer(k, counts, learned, False, f"within the tolerance only: {answer.explanation}", -answer.slack)
    return Offer(k, counts, learned, True, answer.explanation)


def holds_for_ever(learned: Certified) -> bool:
    """Whether the proof covers every step from now on, whenever that is."""
    return isinstance(learned.certificate.claim, AllTimes | AllPhases)


def relearning(prior: JointPrior, plant: ConstrainedSystem, starts: int = 8) -> Learner:
    """Learning from scratch, with bounds of the search from the scales of each window's own samples."""
    return lambda samples: learn_certified(samples, prior, plant, SearchSpace.around(samples, prior, starts=starts))


def receding(samples: tuple[Samples, ...], until: float, count: int) -> tuple[Samples, ...]:
    """The last `count` samples of each signal taken no later than `until` [s]. ValueError where there is none."""
    return tuple(_last(s, until, count) for s in samples)


def _last(samples: Samples, until: float, count: int) -> Samples:
    seen = np.flatnonzero(samples.times <= until)[-count:]
    if not seen.size:
        raise ValueError(f"online: no sample has arrived by {until:g} s, the first comes at {samples.times[0]:g} s")
    return Samples(samples.times[seen], samples.values[seen], samples.relative_noise[seen], samples.stencil)
