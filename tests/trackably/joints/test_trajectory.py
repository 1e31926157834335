"""Trajectories of joints: what planners and messages say is what is read, at all times between the points."""

import logging
from collections.abc import Callable
from functools import partial
from math import factorial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator, BPoly, CubicSpline, PchipInterpolator, make_interp_spline

from tests.trackably.joints.trajectories import random_spline
from trackably import (
    CertifiedTrajectory,
    Gate,
    Joints,
    JointTrajectory,
    certify_joints,
    read_joint_trajectory,
    repair_joints,
    stretch_joints,
    write_joint_trajectory,
)
from trackably.errors import InputError

T = np.array([0.0, 0.4, 1.0, 1.5])
Q = np.array([[0.0, 0.1], [0.2, -0.1], [0.1, 0.3], [0.4, 0.2]])
V, A = Q[::-1] * 1.5, Q - 0.3
CURVE = CubicSpline(T, Q)
FINE = np.linspace(0.0, 1.5, 301)[:-1]

SPLINES: dict[str, Callable[[], Any]] = {
    "cubic": lambda: CubicSpline(T, Q, bc_type="clamped"),
    "pchip": lambda: PchipInterpolator(T, Q),
    "akima": lambda: Akima1DInterpolator(T, Q),
    "B-spline": lambda: make_interp_spline(T, Q, k=3),
    "Bernstein": lambda: BPoly.from_derivatives(T, np.stack([Q, V], axis=1)),
}


@pytest.mark.parametrize("name", SPLINES)
def test_splines_of_several_columns_are_read(name: str) -> None:
    spline = SPLINES[name]()
    found = JointTrajectory.of(spline, ["a", "b"])
    for order in range(3):
        wanted = (
            spline(FINE, order) if name != "Bernstein" else spline.derivative(order)(FINE) if order else spline(FINE)
        )
        np.testing.assert_allclose(found(FINE, order), wanted, atol=1e-9 * 10**order)


def test_curves_by_name_share_their_times() -> None:
    other = CubicSpline([0.1, 0.7, 1.5], [0.0, 1.0, 0.5])
    found = JointTrajectory.of({"a": CubicSpline(T, Q[:, 0]), "b": other})
    assert found.span == (0.1, 1.5)
    np.testing.assert_allclose(found(FINE[30:])[:, 1], other(FINE[30:]), atol=1e-12)


def naive(t: float, i: int, fields: list[np.ndarray]) -> np.ndarray:
    """Return what goes through the fields of two points, by a linear system for its coefficients."""
    n, h = 2 * len(fields), T[i + 1] - T[i]

    def row(x: float, r: int) -> list[float]:
        return [factorial(k) / factorial(k - r) * x ** (k - r) if k >= r else 0.0 for k in range(n)]

    M = [row(x, r) for x in (0.0, h) for r in range(len(fields))]
    right = [f[k] for k in (i, i + 1) for f in fields]
    return np.array([(t - T[i]) ** k for k in range(n)]) @ np.linalg.solve(M, right)


@pytest.mark.parametrize("fields", [[Q], [Q, V], [Q, V, A]], ids=["linear", "cubic", "quintic"])
def test_points_are_met_as_the_controller_meets_them(fields: list[np.ndarray]) -> None:
    found = JointTrajectory.through(T, *fields)
    assert found.degree == 2 * len(fields) - 1
    for t in FINE[::7]:
        i = int(np.searchsorted(T, t, side="right")) - 1
        np.testing.assert_allclose(found(t), naive(t, i, fields), atol=1e-12)


def test_positions_alone_are_upsampled_by_the_spline_at_rest() -> None:
    found = JointTrajectory.through(T, Q, upsampled=True)
    np.testing.assert_allclose(found(FINE), CubicSpline(T, Q, bc_type="clamped")(FINE), atol=1e-12)


@pytest.mark.parametrize("name", ["arm.yaml", "arm.mcap"])
@pytest.mark.parametrize("fields", [[Q], [Q, V], [Q, V, A]], ids=["linear", "cubic", "quintic"])
def test_messages_come_back(name: str, fields: list[np.ndarray], tmp_path: Path) -> None:
    given = JointTrajectory.through(T, *fields, names=["a", "b"])
    found = read_joint_trajectory(write_joint_trajectory(given, tmp_path / name))
    assert found.names == given.names
    np.testing.assert_allclose(found(FINE), given(FINE), atol=1e-8)


POINT = "{{positions: [{}], velocities: [{}], accelerations: [{}], time_from_start: {{sec: {}, nanosec: 0}}}}"


def message(folder: Path, *points: str, joints: str = "[a]") -> Path:
    (folder / "m.yaml").write_text(f"joint_names: {joints}\npoints: [{', '.join(points)}]\n")
    return folder / "m.yaml"


def test_what_points_lack_is_integrated(tmp_path: Path) -> None:
    """From 1 with velocity 2 to velocity 4 in 1 s: 4; then with acceleration 2, from 0, in 2 s: v = 6, q = 14."""
    file = message(tmp_path, POINT.format(1, 2, "", 0), POINT.format("", 4, "", 1), POINT.format("", "", 2, 3))
    found = read_joint_trajectory(file)
    ends = [found(t, 0)[0] for t in (0.0, 1.0)]
    np.testing.assert_allclose([*ends, found(3.0)[0]], [1.0, 4.0, 14.0])
    assert found(1.0, 2)[0] == 0.0  # an acceleration that is needed, and not known, is zero


def test_slowing_and_delaying_keep_the_path() -> None:
    given = random_spline(np.random.default_rng(0), 2)
    moved = given.slowed(1.7).delayed(3.0)
    for order in range(4):
        t = np.linspace(*given.span, 50)[:-1]
        np.testing.assert_allclose(moved(3.0 + 1.7 * t, order), given(t, order) / 1.7**order, atol=1e-9)


ARM = Joints(velocity=1.0, names=["a", "b"])
GATE = Gate(ARM)
RESTING = GATE.at_rest([0.0, 0.0], 0.0)
through = JointTrajectory.through
one = partial(Joints, names=["a"])
points = partial(message, joints="[a]")
WRONG: dict[str, tuple[Callable[[], object], type[Exception], str]] = {
    "no names": (lambda: Joints(velocity=1.0), ValueError, "give names="),
    "a name of spaces": (lambda: Joints(velocity=1.0, names=["a b"]), ValueError, "a name must be letters"),
    "a limit in words": (lambda: one(velocity="fast"), TypeError, "velocity of a: expected numbers, got 'fast'"),
    "a position's one end": (lambda: one(position=2.0), ValueError, "give a lower and an upper end, got 2.0"),
    "limits turned round": (lambda: one(position={"a": (1, 0)}), ValueError, "interior, got [1.0, 0.0]"),
    "a turning joint's position": (lambda: one(position={"a": (0, 1)}, continuous=["a"]), ValueError, "is continuous"),
    "a function": (lambda: certify_joints(np.sin, ARM), TypeError, "expected a spline of SciPy with a column"),
    "a column too many": (lambda: certify_joints(CURVE, one(velocity=1)), ValueError, "each of 1 names, got 2"),
    "other joints": (lambda: certify_joints(through(T, Q), ARM), ValueError, "must have the joints a, b, but 'a' is"),
    "a tolerance of zero": (lambda: certify_joints(CURVE, ARM, 0.0), ValueError, "tolerance must be positive"),
    "accelerations alone": (lambda: through(T, Q, None, A), ValueError, "accelerations need velocities"),
    "an infinite position": (lambda: through(T, Q + np.inf), ValueError, "must be finite"),
    "curves that never meet": (
        lambda: JointTrajectory.of({"a": CubicSpline([0, 1], [0, 1]), "b": CubicSpline([2, 3], [0, 1])}),
        ValueError,
        "no time in common",
    ),
    "rests in words": (lambda: JointTrajectory(["a"], [0, 1], [[[0.0]]], "yes"), TypeError, "rests: expected True or"),  # type: ignore[arg-type]
    "a start of another shape": (
        lambda: repair_joints(CubicSpline(T, Q), ARM, start=[[0.0]]),
        ValueError,
        "start: orders, joints must have shape (any, 2), got shape (1, 1)",
    ),
    "joints that must move": (
        lambda: stretch_joints(CubicSpline(T, Q), Joints(velocity={"a": (0.5, 1), "b": (0.5, 1)})),
        ValueError,
        "limits of the velocity of a must have 0 inside",
    ),
    "a lead into the past": (lambda: Gate(ARM, lead=-1.0), ValueError, "lead must not be negative, got -1.0"),
    "nothing that runs": (lambda: GATE(CubicSpline(T, Q), None, 0.0), TypeError, "running: expected a Certified"),  # type: ignore[arg-type]
    "now before what runs": (lambda: GATE(CubicSpline(T, Q), RESTING, -1.0), ValueError, "after now, -1 s"),
    "a file of another kind": (lambda: read_joint_trajectory("a.txt"), ValueError, "an .mcap or .yaml file, got a.txt"),
    "degree 7": (
        lambda: write_joint_trajectory(JointTrajectory(["a"], [0, 1], np.ones((1, 1, 8))), "a.yaml"),
        ValueError,
        "degrees up to 5, but pieces have degree 7",
    ),
    "a point that jumps": (
        lambda: write_joint_trajectory(JointTrajectory(["a"], [0, 1, 2], [[[0.0], [1.0]]]), "a.yaml"),
        ValueError,
        "positions jump by 1",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_in_a_sentence(name: str) -> None:
    call, kind, said = WRONG[name]
    with pytest.raises(kind) as refused:
        call()
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


MESSAGES = {
    "one point": ([POINT.format(0, "", "", 0)], "two points at least"),
    "a position too many": ([POINT.format(0, "", "", 0), POINT.format("0, 0", "", "", 1)], "must be 1 finite numbers"),
    "nothing known": ([POINT.format(0, "", "", 0), POINT.format("", "", "", 1)], "nor anything to integrate"),
    "accelerations alone": ([POINT.format(0, "", 1, 0), POINT.format(0, "", 1, 1)], "accelerations need velocities"),
    "no time": (["{positions: [0]}", POINT.format(0, "", "", 1)], "expected time_from_start"),
}  # fmt: skip


@pytest.mark.parametrize("name", MESSAGES)
def test_a_wrong_message_is_refused_in_a_sentence(name: str, tmp_path: Path) -> None:
    given, said = MESSAGES[name]
    with pytest.raises(InputError, match=r"m\.yaml") as refused:
        read_joint_trajectory(message(tmp_path, *given))
    assert said in str(refused.value)


@pytest.mark.parametrize("parametrizer", ["ParametrizeSpline", "ParametrizeConstAccel"])
def test_what_topp_ra_hands_out_is_read(parametrizer: str) -> None:
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


def ruckig_like(off: float = 0.0) -> SimpleNamespace:
    """Return what has the fields of Ruckig's trajectories: seven phases of constant jerk, one joint's after a brake."""
    phases = [(0.1, 20.0), (0.2, 0.0), (0.1, -20.0), (0.3, 0.0), (0.1, -20.0), (0.2, 0.0), (0.1, 20.0)]

    def profile(brake: list[tuple[float, float]], v: float) -> SimpleNamespace:
        states, every = [(0.0, v, 0.0)], [*brake, *phases]
        for t, j in every:
            p, v, a = states[-1]
            states.append((p + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t))
        n = len(brake)

        def part(some: slice) -> SimpleNamespace:
            p, v, a = ([state[k] for state in states[:-1][some]] for k in range(3))
            return SimpleNamespace(t=[t for t, _ in every[some]], j=[j for _, j in every[some]], p=p, v=v, a=a)

        pf, vf, af = states[-1]
        return SimpleNamespace(**vars(part(slice(n, None))), brake=part(slice(n)), pf=pf, vf=vf, af=af)

    profiles = [profile([], 0.0), profile([(0.1, -10.0), (0.1, 10.0)], 0.1)]

    def at_time(t: float) -> tuple[list[float]]:
        found = []
        for of in profiles:
            left, rows = t, [*zip(of.brake.t, of.brake.p, of.brake.v, of.brake.a, of.brake.j, strict=True),
                             *zip(of.t, of.p, of.v, of.a, of.j, strict=True)]  # fmt: skip
            for h, p, v, a, j in [*rows, (np.inf, of.pf, of.vf, of.af, 0.0)]:
                if left <= h:
                    found.append(p + v * left + a * left**2 / 2 + j * left**3 / 6 + off)
                    break
                left -= h
        return (found,)

    return SimpleNamespace(profiles=[profiles], at_time=at_time, duration=1.3)


def test_what_ruckig_hands_out_is_read() -> None:
    given = ruckig_like()
    found = JointTrajectory.of(given, ["a", "b"])
    assert found.span == (0.0, 1.3)
    for t in FINE[FINE < 1.3]:
        np.testing.assert_allclose(found(t), given.at_time(t)[0], atol=1e-12)
    with pytest.raises(ValueError, match=r"the pieces read from Ruckig differ from its own values by 0\.001"):
        JointTrajectory.of(ruckig_like(off=1e-3))


def test_limits_are_widened_by_a_part_of_their_widths() -> None:
    wide = Joints(position={"a": (0, 1)}, velocity=2.0, names=["a", "b"], continuous=["b"]).widened(0.1)
    assert wide.position.tolist() == [[-0.05, 1.05], [-np.inf, np.inf]]
    np.testing.assert_allclose(wide.velocity, [[-2.2, 2.2]] * 2)
    assert wide.continuous == {"b"}
