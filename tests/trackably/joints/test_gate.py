"""The gate: whatever comes, what runs is proved, continuous, and ends at rest."""

import numpy as np
import pytest

from tests.attack.joints import Stream
from trackably import Gate, Joints, JointTrajectory, repair_joints

ARM = Joints(position=[(-2, 2)] * 3, velocity=2.0, acceleration=10.0, jerk=200.0, names=["a", "b", "c"])


@pytest.mark.parametrize("seed", range(2))
def test_whatever_comes_what_runs_keeps_its_limits(seed):
    stream = Stream(seed)
    for _ in range(12):
        stream.step()
    assert stream.false == []


def chunk(start, level):
    t = start + np.linspace(0.0, 1.0, 21)
    q = np.array([level, 0.0, -level]) + 0.1 * np.sin(2 * (t[:, None] - start) + np.arange(3.0))
    return JointTrajectory.through(t, q, np.gradient(q, t, axis=0), np.zeros(q.shape), ARM.names)


def test_a_chunk_that_is_met_runs_to_its_end_and_a_stop_is_shorter():
    gate = Gate(ARM, lead=0.01)
    running = gate.at_rest(chunk(0.0, 0.0)(0.0), 0.0)
    first = gate(chunk(0.0, 0.0), running, 0.0)
    assert first.kind == "stitched"
    motion = first.running.trajectory
    np.testing.assert_allclose(motion(0.005), running.trajectory(0.005))
    np.testing.assert_allclose(motion(0.9), chunk(0.0, 0.0)(0.9), atol=0.05)
    stopped = gate.stop(first.running, 0.5)
    assert stopped.kind == "stopped"
    assert stopped.running.trajectory.span[1] < 1.0 < motion.span[1]
    assert gate.stop(stopped.running, 5.0).kind == "kept"


@pytest.mark.parametrize("now", [0.5, 1.0, 1.0 + 5e-7])
def test_a_chunk_is_met_where_the_running_motion_ends(now):
    given = JointTrajectory.through([1.0, 2.2], [[0.0], [0.3]], [[0.0], [0.0]], [[0.0], [0.0]], names=["a"])
    jerk = 1.0001 * float(np.max(np.abs(given(np.linspace(1.0, 2.19, 999), 3))))
    gate = Gate(Joints(velocity=1.0, acceleration=3.0, jerk=jerk, names=["a"]))
    assert gate(given, gate.at_rest([0.0], 0.0), now).kind == "stitched"


def test_a_stop_far_back_in_a_chunk_is_found():
    """Of 200 pieces, stops are possible behind the first ones only, which are slow."""
    joint = Joints(position=[(-1, 1)], velocity=5.0, acceleration=20.0, names=["a"])
    t = np.linspace(0.0, 1.0, 201)
    q = np.where(t < 0.1, 0.0, (t - 0.1) ** 2 * 1.2)[:, None]
    given = JointTrajectory.through(t, q, np.where(t < 0.1, 0.0, 2.4 * (t - 0.1))[:, None], names=["a"])
    answer = Gate(joint)(given, Gate(joint).at_rest([0.0], 0.0), 0.0)
    assert answer.kind == "stitched"
    assert 0.1 < answer.running.trajectory.span[1] < 2.0


def test_a_chunk_that_is_late_or_out_of_reach_changes_nothing():
    with pytest.raises(TypeError):  # a third number was a budget [s] before, and would be a large tolerance
        Gate(ARM, 0.0, 0.3)
    gate = Gate(ARM)
    running = gate.at_rest([0.0, 0.0, 0.0], 0.0)
    for given, now in ((chunk(0.0, 0.0), 1.0), (chunk(0.0, 9.0), 0.1)):
        answer = gate(given, running, now)
        assert answer.kind == "kept"
        assert answer.running is running


def test_a_chunk_that_breaks_a_limit_is_not_run_and_the_reason_names_it_but_its_repair_is():
    """Between two points 0.05 s apart, positions are off by 0.1: the velocity of a is far above its limit."""
    t = np.linspace(0.0, 1.0, 21)
    q = np.where(t == 0.5, 0.1, 0.0)[:, None] * np.ones(3)
    given = JointTrajectory.through(t, q, np.zeros(q.shape), names=ARM.names)
    gate = Gate(ARM)
    answer = gate(given, running := gate.at_rest([0.0, 0.0, 0.0], 0.0), 0.0)
    assert answer.kind == "kept"
    assert gate(repair_joints(given, ARM).trajectory, running, 0.0).kind == "stitched"
    assert 'the velocity of "a" is not shown to keep [-2, 2] from 0.45 s to 0.5 s' in answer.reason


def test_turning_joints_are_met_whole_turns_away():
    wheel = Joints(velocity=2.0, acceleration=5.0, names=["wheel"], continuous=True)
    gate = Gate(wheel)
    running = gate.at_rest([20 * np.pi + 0.01], 0.0)
    given = JointTrajectory.through([0.2, 0.7, 1.2], [[0.0], [0.1], [0.2]], [[0.0], [0.2], [0.0]], names=["wheel"])
    answer = gate(given, running, 0.0)
    assert answer.kind == "stitched"
    assert answer.running.trajectory(9.0)[0] == pytest.approx(20 * np.pi + 0.2)
