"""Bounds and given values that no reference can satisfy, whatever its kernel and its samples."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trackably.arrays import Array
from trackably.certificates.form import as_written
from trackably.certificates.goal import Claim
from trackably.certificates.judge import judged_contradiction
from trackably.certificates.outcome import Impossible, InfeasibleTightening
from trackably.certificates.pinned import Pinned, extent
from trackably.checker.contradiction import FORMAT, VERSION
from trackably.feasibility.steps import Least, Steps, first_gap, least, steps_of
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.tightening import Tightening

_NOTHING = 1e-6  # of a width: solvers find no less
_ACTIVE = 1e-6  # of the largest multiplier
_PARTS = (1 - 1e-9, 1 - 1e-6, 1 - 1e-3, 0.9, 0.5, 0.1)
"""Parts of what a solver finds to be missing: the checker is asked about each until it accepts one."""


def impossible(
    plant: ConstrainedSystem,
    claim: Claim,
    pinned: Sequence[Pinned],
    means: Sequence[float],
    tightening: Tightening | None = None,
) -> Impossible | InfeasibleTightening | None:
    """Return what contradicts what at steps that are claimed; None where no contradiction is certain.

    Where `plant` is what a `tightening` leaves, the given plant is asked first: only its own bounds exclude every
    reference. What is said is proved: programs say where to look and by how much, and what is returned is a file that
    the checker has accepted. It is not complete: no times between steps are examined, of nonlinear systems boxes that
    can be reached only, and of vehicles nothing. Without `pinned` values there is nothing to ask where the plant may
    rest at the `means` of its flat outputs.
    """
    if tightening is None:
        return _of_bounds(plant, claim, pinned, means)
    found = _of_bounds(tightening.given, claim, pinned, means)
    if found is None and (drawn_in := _of_bounds(plant, claim, pinned, means)):
        return InfeasibleTightening(
            drawn_in.given, drawn_in.missing, drawn_in.among, drawn_in.contradiction, tightening
        )
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
    return None if found is None or found.missing <= 0 else _accepted(_told(found))


def _accepted(found: Impossible) -> Impossible | None:
    """Return nearly as much as what was found to be missing, as the checker accepts it; None where it does not."""
    for part in _PARTS:
        missing = part * found.missing
        nearly = replace(found, missing=missing, contradiction={**found.contradiction, "missing": missing})
        if judged_contradiction(nearly) is nearly:
            return nearly
    return None


def _file(steps: Steps, first: int, count: int, missing: float, proof: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the checker reads about so many steps from the `first` on."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "plant": as_written(steps.plant),
        "start": steps.time(first),
        "steps": count,
        "values": [
            {**vars(value), "step": value.step - first} for value in steps.values if first <= value.step < first + count
        ],
        "missing": missing,
        "proof": proof,
    }


def _of_nonlinear(steps: Steps) -> Impossible | None:
    """Return what cannot be reached; None of vehicles, whose headings count up to whole turns only."""
    system = steps.plant.system
    if not isinstance(system, NonlinearSystem) or (system.flat and system.flat.angles):
        return None
    if (found := first_gap(steps)) is None:
        return None
    gap, missing = found
    bounds = {name: extent(steps.plant, name) for name in steps.names}
    before = [value for value in steps.values if value.step <= gap.step]
    values = [f"{of.name} = {(of.lower + of.upper) / 2:.6g} at t = {steps.time(of.step):.6g} s" for of in before]
    given = (said for said, of in zip(values, before, strict=True) if (of.step, of.name) == (gap.step, gap.name))
    wanted = next(given, f"{gap.name} in {bounds[gap.name]} at t = {steps.time(gap.step):.6g} s")
    among = [said for said in values if said != wanted] + [f"{name} in {of}" for name, of in bounds.items() if of]
    proof = {"kind": "boxes", **vars(gap)}
    return _accepted(Impossible(wanted, missing, tuple(among), _file(steps, 0, gap.step + 1, missing, proof)))


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


def _told(found: Least) -> Impossible:
    steps = found.steps
    if not steps.values:
        return Impossible("", found.missing, (*_bounds(found),), _multipliers(found, found.missing))
    *others, last = _values(found)
    missing, among = found.missing * steps.widths[-1].item(), (*filter(None, others), *_bounds(found))
    return Impossible(last, missing, among, _multipliers(found, missing))


def _multipliers(found: Least, missing: float) -> dict[str, Any]:
    """Return the contradiction's file: the steps from the first to the last one that matters, n of them at least."""
    steps, r = found.steps, len(found.steps.plant.state_set.rows)
    signed, rows = found.at_upper - found.at_lower, len(found.at_upper) - len(found.steps.values)
    of_bounds, of_values = signed[:rows].reshape(steps.count, -1), signed[rows:].tolist()
    that_matter = [value.step for value, y in zip(steps.values, of_values, strict=True) if y]
    active = [*np.flatnonzero(np.any(of_bounds, axis=1)).tolist(), *that_matter]
    first, last = (min(active), max(active)) if active else (0, steps.count - 1)
    first = max(0, min(first, steps.count - len(steps.plant.system.states)))
    last = min(max(last, first + len(steps.plant.system.states) - 1), steps.count - 1)
    within = of_bounds[first : last + 1]
    proof = {
        "kind": "multipliers",
        "states": within[:, :r].tolist(),
        "inputs": within[:, r:].tolist(),
        "values": [y for value, y in zip(steps.values, of_values, strict=True) if first <= value.step <= last],
    }
    return _file(steps, first, last + 1 - first, missing, proof)


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
