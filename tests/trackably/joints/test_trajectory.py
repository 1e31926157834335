"""Trajectories of joints: what planners and messages say is what is read, at all times between the points."""

import logging
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import BPoly, CubicSpline, PPoly, make_interp_spline

from tests.trackably.joints.trajectories import random_spline
from trackably import (
    CertifiedTrajectory,
    Gate,
    Joints,
    JointTrajectory,
    certify_joints,
    read_joint_trajectory,
    stretch_joints,
    write_joint_trajectory,
)
from trackably.errors import InputError

T = np.array([0.0, 0.4, 1.0, 1.5])
Q = np.array([[0.0, 0.1], [0.2, -0.1], [0.1, 0.3], [0.4, 0.2]])
V, A = Q[::-1] * 1.5, Q - 0.3
CURVE = CubicSpline(T, Q)
FINE = np.linspace(0.0, 1.5, 301)[:-1]

SPLINES = {
    "cubic": CURVE,
    "B-spline": make_interp_spline(T, Q, k=3),
    "Bernstein": BPoly.from_derivatives(T, np.stack([Q, V], axis=1)),
}


@pytest.mark.parametrize("name", SPLINES)
def test_splines_of_several_columns_are_read(name):
    found = JointTrajectory.of(SPLINES[name], ["a", "b"])
    for order in range(3):
        wanted = (SPLINES[name].derivative(order) if order else SPLINES[name])(FINE)
        np.testing.assert_allclose(found(FINE, order), wanted, atol=1e-9 * 10**order)


POINTS = {"linear": [Q], "cubic": [Q, V], "quintic": [Q, V, A]}
as_points = pytest.mark.parametrize("fields", POINTS.values(), ids=POINTS)


@as_points
@pytest.mark.parametrize("upsampled", [False, True])
def test_points_are_met_with_all_that_both_ends_have(fields, upsampled):
    """Positions alone are upsampled, if asked for, by the spline that begins and ends at rest."""
    found = JointTrajectory.through(T, *fields, upsampled=upsampled)
    used = [Q, CubicSpline(T, Q, bc_type="clamped")(T, 1)] if upsampled and len(fields) == 1 else fields
    assert found.degree == 2 * len(used) - 1
    np.testing.assert_allclose(found(FINE), BPoly.from_derivatives(T, np.stack(used, axis=1))(FINE), atol=1e-12)


@pytest.mark.parametrize("name", ["arm.yaml", "arm.mcap"])
@as_points
def test_messages_come_back(name, fields, tmp_path):
    given = JointTrajectory.through(T, *fields, names=["a", "b"])
    found = read_joint_trajectory(write_joint_trajectory(given, tmp_path / name))
    assert found.names == given.names
    np.testing.assert_allclose(found(FINE), given(FINE), atol=1e-8)


POINT = "{{positions: [{}], velocities: [{}], accelerations: [{}], time_from_start: {{sec: {}, nanosec: 0}}}}"


def message(folder, *points, joints="[a]"):
    (folder / "m.yaml").write_text(f"joint_names: {joints}\npoints: [{', '.join(points)}]\n")
    return folder / "m.yaml"


def test_slowing_keeps_the_path():
    given = random_spline(np.random.default_rng(0), 2)
    moved = given.slowed(1.7)
    for order in range(4):
        t = np.linspace(*given.span, 50)[:-1]
        np.testing.assert_allclose(moved(1.7 * t, order), given(t, order) / 1.7**order, atol=1e-9)


ARM = Joints(velocity=1.0, names=["a", "b"])
through = JointTrajectory.through
WRONG = {
    "other joints": (lambda: certify_joints(through(T, Q), ARM), "must have the joints a, b, got "),
    "degree 7": (
        lambda: write_joint_trajectory(JointTrajectory(["a"], [0, 1], np.ones((1, 1, 8))), "a.yaml"),
        "pieces of degree 5 at most, got degree 7",
    ),
    "a spline to write": (lambda: write_joint_trajectory(CURVE, "a.yaml"), "expected a JointTrajectory, got"),
    "accelerations alone": (lambda: through(T, Q, None, A), "accelerations need velocities"),
    "joints that must move": (
        lambda: stretch_joints(CURVE, Joints(velocity={"a": (0.5, 1), "b": (0.5, 1)})),
        "limits of the velocity of a must have 0 inside",
    ),
    "a rest beyond a limit by rounding": (
        lambda: Gate(Joints([(-1, 1)], names=["a"])).at_rest([1 + 1e-9], 0.0),
        "the position of a starts at 1.000000001, outside of [-1, 1]",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_in_a_sentence(name):
    call, said = WRONG[name]
    with pytest.raises((TypeError, ValueError)) as refused:
        call()
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


MESSAGES = {
    "nothing known": ([POINT.format(0, "", "", 0), POINT.format("", 1, 1, 1)], "points[1]: expected positions, got"),
    "no time": (["{positions: [0]}", POINT.format(0, "", "", 1)], "expected time_from_start"),
    "no points": ([], "two points at least are needed"),
}  # fmt: skip


@pytest.mark.parametrize("name", MESSAGES)
def test_a_wrong_message_is_refused_in_a_sentence(name, tmp_path):
    given, said = MESSAGES[name]
    with pytest.raises(InputError, match=r"m\.yaml") as refused:
        read_joint_trajectory(message(tmp_path, *given, joints="[a]" if given else "[]"))
    assert said in str(refused.value)


@pytest.mark.parametrize("parametrizer", ["ParametrizeSpline", "ParametrizeConstAccel"])
def test_what_topp_ra_hands_out_is_read(parametrizer):
    toppra = pytest.importorskip("toppra")
    logging.getLogger("toppra").setLevel(logging.ERROR)
    path = toppra.SplineInterpolator(T, Q)
    limits = [np.array([[-1.0, 1.0]] * 2), np.array([[-3.0, 3.0]] * 2)]
    kinds = toppra.constraint.JointVelocityConstraint, toppra.constraint.JointAccelerationConstraint
    asked = [kind(limit) for kind, limit in zip(kinds, limits, strict=True)]
    planned = toppra.algorithm.TOPPRA(asked, path, parametrizer=parametrizer).compute_trajectory(0, 0)
    found = JointTrajectory.of(planned, ["a", "b"])
    t = np.linspace(*found.span, 200)[1:-1]
    for order in range(3):
        np.testing.assert_allclose(found(t, order), planned(t, order), atol=1e-6)
    stretched = stretch_joints(found, Joints(velocity=1.0, acceleration=3.0, names=["a", "b"]))
    assert isinstance(stretched, CertifiedTrajectory)
    assert stretched.factor < 1.5


def ruckig_like(off=0.0):
    """Return what has the fields of Ruckig's trajectories: phases of constant jerk, between which accelerations jump.

    Those of the second joint come after a brake. The velocities that it tells are `off`.
    """
    curves, profiles, phases = [], [], [0.1, 0.2, 0.1, 0.3, 0.1, 0.2, 0.1]
    for brake in ([0.0, 0.0], [0.1, 0.1]):
        ends = np.cumsum([0.0, *filter(None, brake), *phases, 9.0])
        acceleration = np.random.default_rng(len(ends)).normal(size=(2, len(ends) - 1))
        curves.append(PPoly(acceleration, ends).antiderivative(2))
        profiles.append(SimpleNamespace(t=phases, brake=SimpleNamespace(t=brake)))

    def at_time(t):
        return np.array([[curve(t, order) + off * (order == 1) for curve in curves] for order in range(3)])

    return SimpleNamespace(profiles=[profiles], at_time=at_time, duration=1.3)


def test_what_ruckig_hands_out_is_read_and_compared_with_what_it_says():
    given = ruckig_like()
    found, t = JointTrajectory.of(given, ["a", "b"]), np.linspace(0.0, 1.3, 301)
    np.testing.assert_allclose(found(t), np.transpose(given.at_time(t)[0]), atol=1e-12)
    np.testing.assert_allclose(found(9.0), found(1.3))
    with pytest.raises(ValueError, match=r"the polynomials read from Ruckig differ by 0\.00"):
        JointTrajectory.of(ruckig_like(off=0.1))


def test_a_piece_is_of_the_fields_that_both_its_points_have(tmp_path):
    """Cubic, and then linear. The mark after a document, as `ros2 topic echo` writes it, is no second one."""
    file = message(tmp_path, POINT.format(1, 2, "", 0), POINT.format(2, 4, "", 1), POINT.format(5, "", "", 2))
    file.write_text(f"{file.read_text()}---\n")
    found = read_joint_trajectory(file)
    np.testing.assert_allclose(found(np.array([0.0, 1 - 1e-9, 1.0, 1.9]), 1)[:, 0], [2.0, 4.0, 3.0, 3.0])
