"""Motions of seven joints by others, with limits of velocity, acceleration and jerk: which of them are kept, exactly.

Each planner is asked for `PROBLEMS` motions through random waypoints, or from rest to rest, within the same limits.
What it hands out is proved or refuted by the library, between its points; limits are widened by `ROUNDING` for it.
"""

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.harness import timed
from benchmarks.rivals.tables import markdown
from trackably.arrays import Array
from trackably.joints.certify import BrokenLimits, CertifiedTrajectory, certify_joints, stretch_joints
from trackably.joints.limits import Joints
from trackably.joints.trajectory import JointTrajectory

PROBLEMS, ROUNDING = 20, 1e-9
NAMES = tuple(f"joint{j + 1}" for j in range(7))
VELOCITY, ACCELERATION, JERK = 2.0, 8.0, 100.0
KINEMATIC = {"velocity": VELOCITY, "acceleration": ACCELERATION}


@dataclass(frozen=True)
class Row:
    """How many of some motions keep their limits; else how far they are outside, as a part of the limit, at most.

    `slowdown` is the largest factor that makes them keep all limits (None where no slowdown does), `seconds` what the
    planner takes in the mean.
    """

    planner: str
    limits: str
    kept: int
    of: int
    worst: float
    seconds: float
    first_broken: str = ""
    slowdown: float | None = None


def _waypoints(rng: np.random.Generator) -> Array:
    return np.cumsum(rng.uniform(-0.8, 0.8, (6, len(NAMES))), axis=0)


def _toppra(rng: np.random.Generator, parametrizer: str = "ParametrizeSpline") -> JointTrajectory:
    import toppra
    from toppra import algorithm, constraint

    logging.getLogger("toppra").setLevel(logging.ERROR)
    path = toppra.SplineInterpolator(np.linspace(0, 1, 6), _waypoints(rng))
    both = [np.tile([-limit, limit], (len(NAMES), 1)) for limit in KINEMATIC.values()]
    asked = [constraint.JointVelocityConstraint(both[0]), constraint.JointAccelerationConstraint(both[1])]
    return JointTrajectory.of(algorithm.TOPPRA(asked, path, parametrizer=parametrizer).compute_trajectory(0, 0), NAMES)


def _points_of_toppra(rng: np.random.Generator) -> JointTrajectory:
    """TOPP-RA's motion as 50 points with velocities, connected by ROS 2's controller."""
    motion = _toppra(rng)
    t = np.linspace(*motion.span, 50)
    return JointTrajectory.through(t, motion(t), motion(t, 1), names=NAMES)


def _ruckig(rng: np.random.Generator) -> JointTrajectory:
    import ruckig

    given = ruckig.InputParameter(len(NAMES))
    given.current_position, given.target_position = (rng.uniform(-2, 2, len(NAMES)).tolist() for _ in range(2))
    for limit, value in (("max_velocity", VELOCITY), ("max_acceleration", ACCELERATION), ("max_jerk", JERK)):
        setattr(given, limit, [value] * len(NAMES))
    found = ruckig.Trajectory(len(NAMES))
    ruckig.Ruckig(len(NAMES)).calculate(given, found)
    return JointTrajectory.of(found, NAMES)


def _spline(rng: np.random.Generator) -> JointTrajectory:
    """A cubic spline that keeps its limits at 50 points, as a planner that looks at these alone would slow it down."""
    spline = JointTrajectory.of(CubicSpline(np.linspace(0, 1, 6), _waypoints(rng), bc_type="clamped"), NAMES)
    t = np.linspace(*spline.span, 50)[:-1]
    most = {r: float(np.max(np.abs(spline(t, r)))) / limit for r, limit in ((1, VELOCITY), (2, ACCELERATION))}
    return spline.slowed(max(most[1], most[2] ** 0.5))


PLANNERS: tuple[tuple[str, Callable[[np.random.Generator], JointTrajectory], dict[str, Any]], ...] = (
    ("TOPP-RA, spline", _toppra, KINEMATIC),
    ("TOPP-RA, constant accelerations", lambda rng: _toppra(rng, "ParametrizeConstAccel"), KINEMATIC),
    ("TOPP-RA, 50 points through ROS 2's controller", _points_of_toppra, KINEMATIC),
    ("SciPy's cubic spline, slowed down by 50 points", _spline, KINEMATIC),
    ("Ruckig", _ruckig, {**KINEMATIC, "jerk": JERK}),
)


def rows() -> Iterator[Row]:
    """Yield a row for each planner."""
    for planner, plan, limits in PLANNERS:
        joints = Joints(names=NAMES, **limits).widened(ROUNDING)
        motions, seconds = timed(lambda plan=plan: [plan(np.random.default_rng(number)) for number in range(PROBLEMS)])
        answers = [certify_joints(motion, joints, tolerance=1e-7) for motion in motions]
        broken = [each for answer in answers if isinstance(answer, BrokenLimits) for each in answer.broken]
        stretched = [stretch_joints(motion, joints, tolerance=1e-7) for motion in motions]
        factors = [answer.factor for answer in stretched if isinstance(answer, CertifiedTrajectory)]
        # What is broken most, by which part of its limit, among what each joint breaks first.
        parts = [(each.violation / each.limits[1] if each.limits else np.inf, each.order) for each in broken]
        worst, first = max(parts, default=(0.0, ""))
        kept = sum(isinstance(answer, CertifiedTrajectory) for answer in answers)
        slowdown = max(factors) if len(factors) == PROBLEMS else None
        yield Row(planner, ", ".join(limits), kept, PROBLEMS, worst, seconds / PROBLEMS, first, slowdown)


def page(found: Sequence[Row]) -> str:
    """Return the table as Markdown."""
    head = ("planner", "limits", "kept", "broken most", "by", "slowdown", "time")
    return markdown(head, "llrlrrr", map(_cells, found))


def _cells(row: Row) -> list[str]:
    by = f"{100 * row.worst:.2g} %" if row.worst else ""
    slowdown = "none does" if row.slowdown is None else f"{row.slowdown:.4f}"
    counts, time = f"{row.kept} of {row.of}", f"{1e3 * row.seconds:.2g} ms"
    return [row.planner, row.limits, counts, row.first_broken, by, slowdown, time]
