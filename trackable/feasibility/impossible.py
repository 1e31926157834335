"""Bounds and given values of a linear system that no reference can satisfy, whatever its kernel and its samples."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from trackable.arrays import Array
from trackable.certificates.goal import Claim
from trackable.certificates.pinned import Pinned
from trackable.feasibility.certain import certainly_missing
from trackable.feasibility.program import Least, least
from trackable.feasibility.steps import Steps, steps_of
from trackable.learning.problem import NoSolution
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.linear import LinearSystem

_NOTHING = 1e-6  # of a width: solvers find no less
_ACTIVE = 1e-6  # of the largest multiplier


@dataclass(frozen=True, repr=False)
class Impossible(NoSolution):
    """No reference exists: no sequence of states and inputs satisfies bounds and given values, whatever the kernel.

    `given` is the value that cannot be had beside those before it, and `missing` is by how much at least, in its unit.
    Where bounds alone contradict each other, `given` is empty, and `missing` is the least part of their widths by which
    all of them would have to be moved. `among` says what follows from what: bounds and values, with their times.
    """

    given: str
    missing: float
    among: tuple[str, ...]

    @property
    def explanation(self) -> str:
        because = "; ".join(self.among)
        if self.given:
            said = f"{self.given} is out of reach by at least {self.missing:.3g}, because of {because}"
        else:
            said = (
                f"bounds contradict each other, and each of these would have to be moved by {self.missing:.3g} of its "
                f"width at least: {because}"
            )
        return f"no reference exists, whatever the kernel and the samples: {said}"


def impossible(
    plant: ConstrainedSystem, claim: Claim, pinned: Sequence[Pinned], means: Sequence[float]
) -> Impossible | None:
    """Return what contradicts what at steps that are claimed; None where no contradiction is certain.

    What is said is proved: programs say where to look, and ball arithmetic how much is missing (`certainly_missing`).
    It is not complete: only linear systems are examined, and no times between steps. Without `pinned` values there is
    nothing to ask where the plant may rest at the `means` of its flat outputs.
    """
    rests = all(q.bounds.strictly_contains(q.at_rest(means)) for q in plant.quantities)
    if not isinstance(plant.system, LinearSystem) or (rests and not pinned):
        return None
    for steps in steps_of(plant, claim, pinned):
        found = _contradiction(steps)
        if found is not None and (missing := certainly_missing(found)) > 0:
            return _told(found, missing)
    return None


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
