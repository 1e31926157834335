"""States that a nonlinear system can reach between its bounds, step by step, in ball arithmetic."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from flint import arb

from trackably.certificates.balls.arithmetic import ball_arithmetic, float_below
from trackably.certificates.balls.formulas import UndefinedError, at_balls
from trackably.certificates.pinned import extent
from trackably.feasibility.steps import Steps
from trackably.systems.formulas.expression import Expression, variables
from trackably.systems.sets.interval import Interval

_OUTWARDS = 1e-6  # of a width: more than solvers miss of a set's extent

Ends = tuple[arb, arb]
"""The least and the greatest number of an interval, or balls that hold these."""


class Gap(NamedTuple):
    """At `step`, the state or input `name` cannot be where it has to be: it misses that by `missing` at least."""

    step: int
    name: str
    missing: float
    is_given: bool


def first_gap(steps: Steps, f: tuple[Expression, ...]) -> Gap | None:
    """Return what cannot be where bounds and values want it, for x(k+1) = f(x(k), u(k)); None where nothing is found.

    Each state is enclosed by itself, for all others in their intervals: more than can be reached, and never less. Of
    a formula that may be undefined nothing is known.
    """
    states = steps.plant.system.states
    with ball_arithmetic():
        bounds = {name: _ends(of) for name in steps.names if (of := extent(steps.plant, name))}
        last, reached, before = max((value.step for value in steps.values), default=0), dict[str, Ends](), None
        for k in range(steps.count):
            box = dict(bounds)
            given = {of.name: (arb(of.lower), arb(of.upper)) for of in steps.values if of.step == k}
            for there in (reached, given):
                for name, ends in there.items():
                    box[name] = low, high = _both(box[name], ends) if name in box else ends
                    if low > high:
                        return Gap(k, name, float_below(low - high), there is given)
            if k > last and box == before:
                return None
            before, reached = box, _next(dict(zip(states, f, strict=True)), box)
    return None


def _next(f: Mapping[str, Expression], box: Mapping[str, Ends]) -> dict[str, Ends]:
    """Return where the states can be at the next step, those of which something is known."""
    values, found = {name: low.union(high) for name, (low, high) in box.items()}, dict[str, Ends]()
    for name, formula in f.items():
        if variables(formula) <= values.keys():
            try:
                ball = at_balls(formula, values)
            except UndefinedError:
                continue
            found[name] = ball.lower(), ball.upper()
    return found


def _both(one: Ends, other: Ends) -> Ends:
    return one[0].max(other[0]), one[1].min(other[1])


def _ends(bounds: Interval) -> Ends:
    by = arb(_OUTWARDS) * arb(bounds.width)
    return (arb(bounds.lower) - by).lower(), (arb(bounds.upper) + by).upper()
