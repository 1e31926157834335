"""Bounds and given values that no reference can satisfy, whatever its kernel and its samples."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array
from trackably.certificates.goal import Claim
from trackably.certificates.pinned import Pinned, extent
from trackably.feasibility.certain import certainly_missing
from trackably.feasibility.program import Least, least
from trackably.feasibility.reach import first_gap
from trackably.feasibility.steps import Steps, steps_of
from trackably.learning.problem import NoSolution
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbance.tightening import Tightening
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.sets.interval import rounded

_NOTHING = 1e-6  # of a width: solvers find no less
_ACTIVE = 1e-6  # of the largest multiplier


@dataclass(frozen=True, repr=False)
class _OutOfReach(NoSolution):
    """No sequence of states and inputs satisfies bounds and given values.

    `given` is the value that cannot be had beside those before it, or the bounds that a nonlinear system has to leave;
    `missing` is by how much at least, in its unit.
    Where bounds alone contradict each other, `given` is empty, and `missing` is the least part of their widths by which
    all of them would have to be moved. `among` says what follows from what: bounds and values, with their times.
    """

    given: str
    missing: float
    among: tuple[str, ...]

    @property
    def _contradiction(self) -> str:
        because, missing = "; ".join(self.among), rounded(self.missing, "down")
        if self.given:
            return f"{self.given} is out of reach by at least {missing}, because of {because}"
        return (
            f"bounds contradict each other, and each of these would have to be moved by {missing} of its "
            f"width at least: {because}"
        )


@dataclass(frozen=True, repr=False)
class Impossible(_OutOfReach):
    """No reference exists, whatever the kernel, the samples, the feedback and the margin: the plant's own bounds and
    the given values contradict each other."""

    @property
    def explanation(self) -> str:
        return f"no reference exists, whatever the kernel and the samples: {self._contradiction}"


@dataclass(frozen=True, repr=False)
class InfeasibleTightening(_OutOfReach):
    """No reference keeps the bounds drawn in by this `tightening`, whatever the kernel and the samples.

    It depends on the feedback and the margin: with others there may be a reference.
    """

    tightening: Tightening

    @property
    def explanation(self) -> str:
        drawn, others, margin, Z = [], [], self.tightening.margin, self.tightening.invariant
        if Z:
            drawn.append(f"for disturbances under the feedback K = {Z.feedback.tolist()}")
            others.append("another feedback=")
        if margin:
            drawn.append(f"by the margin {margin:g} of each width")
            others.append("a smaller margin=")
        return (
            f"no reference keeps the bounds drawn in {' and '.join(drawn)}, whatever the kernel and the samples; "
            f"{' or '.join(others)} may leave more room: {self._contradiction}"
        )


def impossible(
    plant: ConstrainedSystem,
    claim: Claim,
    pinned: Sequence[Pinned],
    means: Sequence[float],
    tightening: Tightening | None = None,
) -> Impossible | InfeasibleTightening | None:
    """Return what contradicts what at steps that are claimed; None where no contradiction is certain.

    Where `plant` is what a `tightening` leaves, the given plant is asked first: only its own bounds exclude every
    reference. What is said is proved: programs say where to look, and ball arithmetic how much is missing
    (`certainly_missing`). It is not complete: no times between steps are examined, of nonlinear systems boxes that can
    be reached only, and of vehicles nothing. Without `pinned` values there is nothing to ask where the plant may rest
    at the `means` of its flat outputs.
    """
    if tightening is None:
        return _of_bounds(plant, claim, pinned, means)
    found = _of_bounds(tightening.given, claim, pinned, means)
    if found is None and (drawn_in := _of_bounds(plant, claim, pinned, means)):
        return InfeasibleTightening(drawn_in.given, drawn_in.missing, drawn_in.among, tightening)
    return found


def _of_bounds(
    plant: ConstrainedSystem, claim: Claim, pinned: Sequence[Pinned], means: Sequence[float]
) -> Impossible | None:
    rests = all(q.bounds.strictly_contains(q.at_rest(means)) for q in plant.quantities)
    if rests and not pinned:
        return None
    every = steps_of(plant, claim, pinned)
    return next(filter(None, map(_of_linear if isinstance(plant.system, LinearSystem) else _of_nonlinear, every)), None)


def _of_linear(steps: Steps) -> Impossible | None:
    found = _contradiction(steps)
    missing = 0.0 if found is None else certainly_missing(found)
    return _told(found, missing) if found is not None and missing > 0 else None


def _of_nonlinear(steps: Steps) -> Impossible | None:
    """Return what cannot be reached; None of vehicles, whose headings count up to whole turns only."""
    system = steps.plant.system
    if not isinstance(system, NonlinearSystem) or (system.flat and system.flat.angles):
        return None
    gap = first_gap(steps, system.f)
    if gap is None:
        return None
    bounds = {name: extent(steps.plant, name) for name in steps.names}
    before = [value for value in steps.values if value.step <= gap.step]
    values = [f"{of.name} = {(of.lower + of.upper) / 2:.6g} at t = {steps.time(of.step):.6g} s" for of in before]
    wanted = f"{gap.name} in {bounds[gap.name]} at t = {steps.time(gap.step):.6g} s"
    if gap.is_given:
        wanted = next(said for said, of in zip(values, before, strict=True) if (of.step, of.name) == gap[:2])
    among = [said for said in values if said != wanted] + [f"{name} in {of}" for name, of in bounds.items() if of]
    return Impossible(wanted, gap.missing, tuple(among))


def _contradiction(steps: Steps) -> Least | None:
    """Return the program of the first value that cannot be had beside those before it; of bounds, where they alone do.

    None where all rows are satisfied up to what solvers find.
    """
    all_values = least(steps, np.where(steps.is_given, steps.widths, 0.0))
    if all_values is None:
        bounds = steps.with_values(())
        return least(bounds, bounds.widths)
    if all_values.missing <= _NOTHING:
        return None
    for count in range(1, len(steps.values) + 1):
        some = steps.with_values(steps.values[:count])
        found = least(some, np.append(np.zeros(len(some.widths) - 1), some.widths[-1]))
        if found is not None and found.missing > _NOTHING:
            return found
    return None


def _told(found: Least, missing: float) -> Impossible:
    steps = found.steps
    if not steps.values:
        return Impossible("", missing, (*_bounds(found),))
    *others, last = _values(found)
    return Impossible(last, missing * steps.widths[-1].item(), (*filter(None, others), *_bounds(found)))


def _values(found: Least) -> Iterator[str]:
    """Yield the given values, an empty text for those that do not matter."""
    steps, price = found.steps, (found.at_lower + found.at_upper) * found.steps.widths
    first = len(price) - len(steps.values)
    for value, of in zip(steps.values, price[first:].tolist(), strict=True):
        middle = (value.lower + value.upper) / 2
        yield f"{value.name} = {middle:.6g} at t = {steps.time(value.step):.6g} s" if of > _least(price) else ""


def _bounds(found: Least) -> Iterator[str]:
    """Yield the bounds that matter, each with the first and the last time at which it does."""
    steps, constraints = found.steps, found.steps.plant.given_constraints
    times: dict[tuple[int, str], list[float]] = defaultdict(list)
    for side, multipliers in (("lower", found.at_lower), ("upper", found.at_upper)):
        price = multipliers * steps.widths
        for i in np.flatnonzero(price[: steps.count * len(constraints)] > _least(price)).tolist():
            step, row = divmod(i, len(constraints))
            times[row, side].append(steps.time(step))
    for (row, side), at in times.items():
        of = constraints[row]
        bound = of.bounds.lower if side == "lower" else of.bounds.upper
        when = f"at t = {at[0]:.6g} s" if len(at) == 1 else f"from t = {at[0]:.6g} s to {at[-1]:.6g} s"
        yield f"{of.name} ({side} bound {bound:.6g}) {when}"


def _least(price: Array) -> float:
    return _ACTIVE * float(np.max(price))
