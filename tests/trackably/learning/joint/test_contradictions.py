"""Required values and bounds that contradict each other: said so, with names and times, however small it is."""

from dataclasses import replace

import pytest

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


def told(case: Case, *required: tuple[str, float, float]) -> list[tuple[str, str, float]]:
    found = learn_jointly(pinned(known(case), *required).problem)
    assert isinstance(found, UnmetBounds)
    for bound in found.among:
        side = {"lower": "lower bound", "upper": "upper bound", "equal": "given value"}[bound.side]
        assert f"{bound.name} ({side}) at t = {bound.time:.6g} s" in found.explanation
    return [(bound.name, bound.side, bound.time) for bound in found.among]


@pytest.mark.parametrize("by", [0.3, 1e-5])
@pytest.mark.parametrize(("side", "place"), [("upper", 1.0), ("lower", 0.0)])
def test_a_pin_outside_its_bounds(side, place, by):
    outside = place + (by if side == "upper" else -by)
    first, second, *_ = told(SCALAR, ("state", 0.5, outside))
    assert {first, second} == {("state", "equal", 0.5), ("state", side, 0.5)}


@pytest.mark.parametrize("by", [0.1, 1e-5])
def test_two_values_at_one_time(by):
    assert told(SCALAR, ("state", 0.5, 0.3), ("state", 0.5, 0.3 + by)) == [("state", "equal", 0.5)] * 2


def test_states_that_no_admissible_input_links():
    """x(t + T) = a x(t) + b u(t): the input would be above its bound."""
    found = told(SCALAR, ("state", 0.5, 0.05), ("state", 0.55, 0.95))
    assert {("state", "equal", 0.5), ("state", "equal", 0.55), ("input", "upper", 0.5)} <= set(found)


def test_positions_that_velocity_and_input_do_not_allow():
    found = told(AXIS, ("x1", 0.5, 0.1), ("x1", 0.6, 0.9))
    assert {("x1", "equal", 0.5), ("x1", "equal", 0.6)} <= set(found)
    assert {name for name, _, _ in found} > {"x1"}


@pytest.mark.parametrize(
    ("case", "required"),
    [
        (SCALAR, [("state", 0.5, 0.999)]),
        (SCALAR, [("state", 0.5, 0.3), ("state", 0.55, 0.3)]),
        (AXIS, [("x1", 0.5, 0.3), ("x2", 0.5, 0.5), ("u1", 0.5, 0.6)]),
        (MIXED, [(name, time, 0.5) for name in ("x1", "x2") for time in (0.9, 1.3)]),
    ],
    ids=["nearly_outside", "close_in_time", "all_of_one_step", "all_states_twice"],
)
def test_what_can_be_met_is_met(case, required):
    chosen = pinned(known(case), *required)
    found = learn_jointly(chosen.problem)
    assert isinstance(found, Solution)
    for one in chosen.required:
        assert one.trajectory(found.signals, one.time) == pytest.approx(one.value, abs=one.tolerance)
    for constraint in chosen.problem.constraints:
        assert constraint.relative_margin(found, chosen.times).min() >= -1e-9
