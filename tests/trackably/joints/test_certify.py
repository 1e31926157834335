"""Verdicts about trajectories of joints are true, repairs keep limits, and the least slowdown is the least."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.trackably.joints.trajectories import ORDERS, random_spline
from trackably import (
    BrokenLimits,
    CertifiedTrajectory,
    Joints,
    JointTrajectory,
    Proved,
    Refuted,
    Unproved,
    certify_joints,
    check,
    repair_joints,
    stretch_joints,
)

SEEDS = range(4)
T = np.linspace(0.0, 2.0, 9)


def limited(given, part):
    """Return limits that are a part of what a trajectory needs, seen on a fine grid; positions have twice the room."""
    t = np.linspace(*given.span, 20_001)[:-1]
    most = [np.max(np.abs(given(t, r)), axis=0) * (2 if r == 0 else part) for r in range(4)]
    limits = {name: [(-x, x) for x in of] for name, of in zip(ORDERS, most, strict=True)}
    return Joints(names=given.names, **limits)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_broken_first_is_named_for_each_joint(seed, tmp_path):
    given = random_spline(np.random.default_rng(seed), 3)
    joints = limited(given, 0.7)
    found = certify_joints(given, joints)
    assert isinstance(found, BrokenLimits)
    t = np.linspace(*given.span, 20_001)[:-1]
    for j, name in enumerate(given.names):
        broken = next(each for each in found.broken if each.joint == name)
        seen = [
            (float(t[np.argmax(of)]), order)
            for r, order in enumerate(ORDERS)
            if np.any(of := np.abs(given(t, r)[:, j]) > joints.limits[r, j, 1])
        ]
        assert broken.begins == pytest.approx(min(seen)[0], abs=2e-4)
        r = ORDERS.index(broken.order)
        value = given(np.nextafter(broken.time, -1.0), r)[j]
        assert abs(value) - joints.limits[r, j, 1] == pytest.approx(broken.violation, rel=1e-6, abs=1e-9 * abs(value))
    assert isinstance(check(found.save_counterexample(tmp_path / "broken.json")), Refuted)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_least_slowdown_is_the_least(seed, tmp_path):
    given = random_spline(np.random.default_rng(seed), 2)
    joints = limited(given, 0.5)
    found = stretch_joints(given, joints)
    assert isinstance(found, CertifiedTrajectory)
    assert isinstance(check(found.save_certificate(tmp_path / "proof.json")), Proved)
    assert 1.25 < found.factor < 2.1
    assert isinstance(certify_joints(given.slowed(found.factor * (1 - 1e-9)), joints), BrokenLimits)
    assert stretch_joints(found.trajectory, joints).factor == 1.0


def test_the_factor_of_a_slowdown_is_told_up_to_the_largest_that_is_tried():
    """A jump that is 9.6e-10 too large needs the last one, 1 + 1e-9."""
    given = JointTrajectory(["a"], [0, 1, 2], [[[0, 0], [0, 1 + 9.6e-10]]])
    found = stretch_joints(given, Joints(acceleration=9.0, names=["a"]), tolerance=1.0)
    assert isinstance(found, CertifiedTrajectory)
    assert found.trajectory.span[1] == 2 * found.factor > 2


@pytest.mark.parametrize("seed", SEEDS)
def test_a_repair_keeps_limits_and_begins_where_it_has_to(seed):
    rng = np.random.default_rng(seed)
    given = random_spline(rng, 2)
    joints = limited(given, 0.8)
    found = repair_joints(given, joints)
    assert isinstance(found, CertifiedTrajectory)
    np.testing.assert_allclose(found.trajectory.state(0.0, 3), given.state(0.0, 3), atol=1e-9)
    for j, name in enumerate(given.names):
        t = np.linspace(*given.span, 999)
        apart = np.max(np.abs(found.trajectory(t)[:, j] - given(t)[:, j]))
        assert found.moved[name].most == pytest.approx(apart, rel=1e-2)
    start = np.array([given(0.0) + 0.01, [0.02, -0.02], [0.1, 0.0]])
    moved = repair_joints(given, joints, start)
    assert isinstance(moved, CertifiedTrajectory)
    np.testing.assert_allclose(moved.trajectory.state(0.0, 3), start, atol=1e-9)


def test_a_repair_that_cannot_be_is_unproved():
    given = JointTrajectory.through([0.0, 0.1], [[0.0, 0.0], [1.0, 1.0]], names=["a", "b"])
    joints = Joints(position={"a": (-9, 9), "b": (-0.01, 0.01)}, velocity=1.0, acceleration=1.0, names=given.names)
    for speed, reason in (
        (2.0, "the velocity of b starts at 2, outside of [-1, 1]; `start` "),
        (0.9, "no spline of b was found in the given duration"),
    ):
        found = repair_joints(given, joints, start=[[0.0, 0.0], [0.0, speed]])
        assert isinstance(found, Unproved)
        assert reason in found.explanation
        assert found.quantity == "position of b"
    assert isinstance(repair_joints(given, joints, seconds=0.0), Unproved)


LINEAR = JointTrajectory.through(T, np.sin(T)[:, None])
HAND = JointTrajectory.through(T, np.column_stack([np.sin(T), 0.1 * T]), names=["gripper", "arm"], rests=False)
OF_HAND = {"velocity": {"gripper": 2.0}, "acceleration": {"arm": 1.0}}
MOVING = JointTrajectory.of(CubicSpline(T, np.sin(T)[:, None]))
JUMPS = {
    "no limit above the velocity": (LINEAR, {"velocity": 1.0}, []),
    "a limit above the velocity": (LINEAR, {"velocity": 1.0, "acceleration": 1e9}, [("q1", "velocity", 0.25)]),
    "of a joint without a limit above": (HAND, OF_HAND, []),
    "of a joint with a limit far above": (HAND, OF_HAND | {"jerk": {"gripper": 1.0}}, [("gripper", "velocity", 0.25)]),
    "to rest at the end": (MOVING, {"acceleration": 2.0}, [("q1", "velocity", 2.0)]),
    "no rest at the end": (JointTrajectory.of(MOVING, rests=False), {"acceleration": 2.0}, []),
}


@pytest.mark.parametrize("name", JUMPS)
def test_a_derivative_may_jump_only_where_a_joint_has_no_limit_above_it(name):
    given, limits, wanted = JUMPS[name]
    joints = Joints(names=given.names, **limits)
    found = certify_joints(given, joints)
    assert isinstance(found, BrokenLimits if wanted else CertifiedTrajectory)
    assert [(each.joint, each.order, each.time) for each in getattr(found, "broken", []) if each.jumps] == wanted
    stretched = stretch_joints(given, joints)
    assert isinstance(stretched, type(found)), "slowing down does not help"
    assert ("no slower motion mends that, while `repair_joints`" in stretched.explanation) is bool(wanted)
