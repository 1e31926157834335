"""Search for a plan of a nonlinear system within trust regions: first for an admissible one, then for a cheaper one."""

from dataclasses import dataclass

from trackably.control.step.elastic import Change
from trackably.control.step.trajectories import Trajectories
from trackably.systems.reference import Window

MAX_CHANGES = 80
"""A search that has not ended by then ends where it is."""

FOLLOWED = 1e-9
"""The system follows a trajectory if all that it misses adds up to this part of the scales."""

_STATIONARY = 1e-8
"""A search ends where the program promises no more than this part of what it starts from."""

_ACCEPTED, _POOR, _GOOD = 1e-3, 0.25, 0.75
"""The part of the promised decrease that is demanded, that shrinks the trust region, and that lets it grow."""

_LEAST_WEIGHT = 1e-9

_NEWTON_STEPS = 3
"""Enough from `FOLLOWED` down to rounding, as each squares what is missed."""


@dataclass(frozen=True, eq=False)
class Found:
    """A `trajectory` and what the system misses of it: Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁ in scales."""

    trajectory: Window
    missed: float

    @property
    def is_followed(self) -> bool:
        """Whether the system follows it, up to `FOLLOWED`."""
        return self.missed <= FOLLOWED


def restored(trajectories: Trajectories, start: Window) -> Found:
    """Minimise what the system misses, from a `start` that keeps all bounds.

    The result is a local minimum: zero, up to `FOLLOWED`, where a plan is found.
    """
    at, radius, missed = start, 1.0, trajectories.missed(start)
    for _ in range(MAX_CHANGES):
        change = None if missed <= FOLLOWED else trajectories.change(at, 0.0, radius)
        if change is None or missed - change.missed <= _STATIONARY * missed:
            break
        trial = trajectories.moved(at, change)
        ratio = (missed - trajectories.missed(trial)) / (missed - change.missed)
        radius = _next_radius(radius, ratio, change.size)
        if ratio > _ACCEPTED:
            at, missed = trial, trajectories.missed(trial)
    return Found(at, missed)


def cheaper(trajectories: Trajectories, start: Window) -> Found:
    """Minimise the merit w V + Σ_i ‖f(x_i, u_i) − x_(i+1)‖₁ from a trajectory that the system follows.

    V is the cost in its scale. The weight w starts at one and falls as `_steered` says: the penalty is exact where w is
    smaller than one over the largest multiplier. The result is followed, up to `FOLLOWED`, unless the search was given
    up before.
    """
    at, radius, weight = start, 1.0, 1.0
    for _ in range(MAX_CHANGES):
        weight, change = _steered(trajectories, at, weight, radius)
        if change is None:
            break
        trial = trajectories.moved(at, change)
        merit = _merit(trajectories, at, weight)
        promised = merit - weight * trajectories.cost(trial) - change.missed
        if promised <= _STATIONARY * weight * trajectories.cost(at):
            break
        decrease = merit - _merit(trajectories, trial, weight)
        if decrease < _POOR * promised and (better := trajectories.corrected(at, change, weight, radius)) is not None:
            curved = trajectories.moved(at, better)
            if merit - _merit(trajectories, curved, weight) > decrease:
                trial, decrease = curved, merit - _merit(trajectories, curved, weight)
        radius = _next_radius(radius, decrease / promised, change.size)
        if decrease > _ACCEPTED * promised:
            at = trial
    return Found(at, trajectories.missed(at))


def followed(trajectories: Trajectories, found: Found) -> Window:
    """Return the trajectory near by that the system follows up to rounding; bounds are kept up to `FOLLOWED`.

    Raises LinAlgError where Newton's method finds no step.
    """
    at = found.trajectory
    for _ in range(_NEWTON_STEPS):
        at = trajectories.moved(at, trajectories.least_change(at))
    return at


def _merit(trajectories: Trajectories, at: Window, weight: float) -> float:
    return weight * trajectories.cost(at) + trajectories.missed(at)


def _steered(trajectories: Trajectories, at: Window, weight: float, radius: float) -> tuple[float, Change | None]:
    """Return a weight, and the best change for it; None where there is none.

    The weight falls until the change follows the linearised dynamics where any within the trust region does, and where
    none does, until it makes up for a tenth of what the best does. (Byrd, Nocedal and Waltz 2008: Steering exact
    penalty methods for nonlinear programming, Optimization Methods and Software 23.)
    """
    missed, change = trajectories.missed(at), trajectories.change(at, weight, radius)
    if change is None or change.missed <= FOLLOWED:
        return weight, change
    best = trajectories.change(at, 0.0, radius)
    if best is None:
        return weight, None
    needed = FOLLOWED if best.missed <= FOLLOWED else missed - 0.1 * (missed - best.missed)
    while change is not None and change.missed > needed and weight > _LEAST_WEIGHT:
        weight /= 10
        change = trajectories.change(at, weight, radius)
    return weight, change


def _next_radius(radius: float, ratio: float, size: float) -> float:
    """Return the radius after a change of some size that kept a part `ratio` of what it promised."""
    if not ratio >= _POOR:
        return _POOR * size
    return 2 * radius if ratio > _GOOD and size > 0.99 * radius else radius
