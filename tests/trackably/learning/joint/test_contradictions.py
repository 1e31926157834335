"""Required values and bounds that contradict each other: said so, with names and times, however small it is."""

from dataclasses import replace

import pytest

from tests.trackably.gp.instances import over
from tests.trackably.learning.joint.instances import ALL, Case, pinned
from trackably.gp.joint import JointPrior
from trackably.gp.prior import Prior
from trackably.learning.joint.search import learn_jointly
from trackably.learning.problem import Solution, UnmetBounds

SCALAR, AXIS, MIXED = (ALL[name] for name in ("squared_exponential", "axis", "mixed"))


def known(case: Case) -> Case:
    """The same with nothing to learn but the function."""
    parts = (Prior(part.kernel.as_known(), float(part.noise_std), part.mean) for part in case.prior.parts)
    return replace(case, prior=JointPrior(tuple(parts), case.prior.names))


CONTRADICTIONS = {
    **{
        f"outside its bounds by {by}, {side}": (
            SCALAR,
            [("state", 0.5, at + by)],
            {("state", "equal", 0.5), ("state", side, 0.5)},
        )
        for side, at, by in (("upper", 1.0, 0.3), ("upper", 1.0, 1e-5), ("lower", 0.0, -0.3), ("lower", 0.0, -1e-5))
    },
    **{
        f"two values at one time, {by} apart": (
            SCALAR,
            [("state", 0.5, 0.3), ("state", 0.5, 0.3 + by)],
            {("state", "equal", 0.5)},
        )
        for by in (0.1, 1e-5)
    },
    # x(t + T) = a x(t) + b u(t): the input would be above its bound.
    "states that no admissible input links": (
        SCALAR,
        [("state", 0.5, 0.05), ("state", 0.55, 0.95)],
        {("state", "equal", 0.5), ("state", "equal", 0.55), ("input", "upper", 0.5)},
    ),
    "positions that velocity and input do not allow": (
        AXIS,
        [("x1", 0.5, 0.1), ("x1", 0.6, 0.9)],
        {("x1", "equal", 0.5), ("x1", "equal", 0.6)},
    ),
}


@over(CONTRADICTIONS, "case", "required", "among")
def test_what_contradicts_is_told(case, required, among):
    found = learn_jointly(pinned(known(case), *required).problem)
    assert isinstance(found, UnmetBounds)
    assert among <= {(bound.name, bound.side, bound.time) for bound in found.among}
    for bound in found.among:
        side = {"lower": "lower bound", "upper": "upper bound", "equal": "given value"}[bound.side]
        assert f"{bound.name} ({side}) at t = {bound.time:.6g} s" in found.explanation


POSSIBLE = {
    "nearly outside": (SCALAR, [("state", 0.5, 0.999)]),
    "close in time": (SCALAR, [("state", 0.5, 0.3), ("state", 0.55, 0.3)]),
    "all of one step": (AXIS, [("x1", 0.5, 0.3), ("x2", 0.5, 0.5), ("u1", 0.5, 0.6)]),
    "all states twice": (MIXED, [(name, time, 0.5) for name in ("x1", "x2") for time in (0.9, 1.3)]),
}


@over(POSSIBLE, "case", "required")
def test_what_can_be_met_is_met(case, required):
    chosen = pinned(known(case), *required)
    found = learn_jointly(chosen.problem)
    assert isinstance(found, Solution)
    for one in chosen.required:
        assert one.trajectory(found.signals, one.time) == pytest.approx(one.value, abs=one.tolerance)
    for quantity in (constraint.quantity for constraint in chosen.problem.constraints):
        assert quantity.margin(found.signals, chosen.times).min() >= -1e-9 * quantity.bounds.width
