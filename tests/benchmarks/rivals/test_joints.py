"""Motions of joints by others: the page has what was measured, and a row says what the library answers."""

import numpy as np

from benchmarks.rivals import joints, page
from benchmarks.rivals.tables import read


def test_the_page_has_the_rows_that_were_written() -> None:
    assert joints.page(read(joints.Row, page.JOINTS)) in page.PAGE.read_text(encoding="utf-8")


def test_a_planner_that_looks_at_points_breaks_limits_between_them() -> None:
    motion = joints._spline(np.random.default_rng(0))
    t = np.linspace(*motion.span, 50)[:-1]
    assert np.max(np.abs(motion(t, 1))) <= joints.VELOCITY * (1 + 1e-9)
    limits = joints.Joints(names=joints.NAMES, **joints.KINEMATIC).widened(joints.ROUNDING)
    assert isinstance(joints.certify_joints(motion, limits), joints.BrokenLimits)
