"""Repair a trajectory of joints: quadratic programs find the nearest spline that keeps all limits between its knots.

A derivative of a B-spline is a B-spline of a lower degree, and lies between its least and its largest coefficient.
All these coefficients are linear in those of the positions. So limits at all times become a few hundred linear
inequalities for each joint, and never have to be checked between the knots. Joints are independent of each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline

from trackably.arguments import array, numbers
from trackably.arrays import Array, subdivide
from trackably.certificates.outcome import Unproved
from trackably.checker.joints import ORDERS
from trackably.given.accepted import NotAcceptedError, RepairDistance
from trackably.given.repair import Splines, nearest
from trackably.joints.certify import (
    TOLERANCE,
    CertifiedTrajectory,
    fit_joints,
    make_unproved,
)
from trackably.joints.limits import Joints
from trackably.joints.trajectory import JointTrajectory

_DEGREE, _FEWEST = 5, 40  # of a spline: its degree, and least number of intervals between knots
_LOOKS, _TIMES = 4, 4001  # times in each interval for least squares, and times at which distances are computed
_ROUNDING = 1e-6  # a start may be outside of its limits by this part of their widths
_BACKOFFS = (1e-7, 1e-5, 1e-3)
"""Back-offs (tightenings of the limits, relative to their widths), tried in turn: room for the solver's tolerance."""


def repair_joints(
    trajectory: Any, joints: Joints, start: Any = None, tolerance: float = TOLERANCE, seconds: float = np.inf
) -> CertifiedTrajectory | Unproved:
    """Return the trajectory itself if it is proved, and otherwise the nearest spline that is proved.

    The spline has degree 5 and knots at the breakpoints, with further ones in between if these are few. It takes the
    same time, and rests where the given trajectory rests. It is nearest in the root mean square of each joint's
    positions, among splines whose B-spline coefficients keep the limits of `joints`. Some splines keep the limits
    although their coefficients do not; such splines are not considered. `CertifiedTrajectory.moved` tells about how far
    each joint was moved.

    Parameters
    ----------
    trajectory, joints, tolerance
        As in `certify_joints`.
    start
        The state with which the spline begins, shape (orders, J): positions, velocities, accelerations, … of the joints
        in their order; missing orders are zero. By default it is that of the trajectory.
    seconds
        After this time, no further quadratic program is begun.

    Returns
    -------
    CertifiedTrajectory
        Proved.
    Unproved
        No such spline was found, or the time was over. A slower motion may exist (`stretch_joints`).

    Raises
    ------
    ValueError
        As `certify_joints`, and if `start` has another shape.
    TypeError
        As `certify_joints`.
    """
    given, until = fit_joints(trajectory, joints), perf_counter() + seconds
    held = _start_values(given, joints, start)
    if start is None or np.all(np.abs(given.state(given.span[0], len(held)) - held) <= tolerance):
        with suppress(NotAcceptedError):
            return CertifiedTrajectory(given, joints, tolerance)
    if beyond := beyond_limits(joints, held):
        joint, reason = beyond
        return make_unproved(given, joints, f"{reason}; `start` gives the state to begin with", joint)
    splines = HeldSplines.of(given, joints.order)
    for backoff in _BACKOFFS:
        columns = list(_solve(splines, given, joints, held, backoff, until))
        if len(columns) < len(joints.names):
            within = f"{seconds:g} s" if perf_counter() > until else "the given duration within its limits"
            reason = f"no spline of {joints.names[len(columns)]} was found in {within}"
            return make_unproved(given, joints, reason, len(columns))
        spline = BSpline(splines.padded, np.column_stack(columns), _DEGREE)
        found = JointTrajectory.of(spline, given.names, given.rests)
        try:
            return CertifiedTrajectory(found, joints, tolerance, _distances(given, found))
        except NotAcceptedError as refused:
            reason = str(refused)
    return make_unproved(given, joints, reason)


def _start_values(given: JointTrajectory, joints: Joints, start: Any) -> Array:
    """Return what is fixed at the start: positions and derivatives below the highest limited one, shape (orders, J)."""
    R = max(joints.order, 1)
    if start is None:
        return given.state(given.span[0], R)
    rows = np.atleast_2d(numbers("repair_joints: start", start))
    held = array("repair_joints: start: orders, joints", rows, None, len(joints.names))
    return np.vstack([held[:R], np.zeros((max(R - len(held), 0), held.shape[1]))])


def beyond_limits(joints: Joints, held: Array, excess: float = _ROUNDING) -> tuple[int, str] | None:
    """Return the joint whose start is the first value outside of its limits, with a sentence; None if there is none.

    The start `held` has positions and their derivatives, shape (orders, J). An `excess` of up to this part of the
    limits' widths does not count; by default, it is one that may be due to rounding.
    """
    lower, upper = np.moveaxis(joints.widened(excess).limits[: len(held)], 2, 0)
    for r, j in np.argwhere((held < lower) | (held > upper)).tolist():
        low, high = joints.limits[r, j]
        return j, f"the {ORDERS[r]} of {joints.names[j]} starts at {held[r, j]:.10g}, outside of [{low:g}, {high:g}]"
    return None


@dataclass(frozen=True, eq=False)
class HeldSplines(Splines):
    """Splines whose first `order` coefficients are fixed, by the state at the start.

    If they end at rest (`rests`), the last `order` coefficients are equal.
    """

    order: int = 1
    rests: bool = True

    @classmethod
    def of(cls, given: JointTrajectory, order: int) -> HeldSplines:
        """Return splines with knots at the breakpoints of a trajectory, and some in between if these are few."""
        ends = given.breakpoints
        parts = np.maximum(np.ceil(_FEWEST * np.diff(ends) / (ends[-1] - ends[0])), 1).astype(int)
        return cls(subdivide(ends, parts), _DEGREE, order=max(order, 1), rests=given.rests)

    @cached_property
    def coefficients_of(self) -> list[Any]:
        """For each order r, the matrix that maps the coefficients of a spline to those of its r-th derivative."""
        found, t = [sparse.eye_array(self.count, format="csr")], self.padded
        for r in range(self.order):
            p, n = _DEGREE - r, self.count - r
            rate = p / (t[r + 1 + p : r + p + n] - t[r + 1 : r + n])
            found.append(sparse.csr_array(sparse.diags_array(rate) @ (found[-1][1:] - found[-1][:-1])))
        return found

    @cached_property
    def free(self) -> Any:
        """The matrix from the free coefficients to all coefficients; its rows for fixed coefficients are zero."""
        found: Any = sparse.eye_array(self.count, format="csc")[:, self.order :]
        if not self.rests:
            return found
        inner, end = found[:, : -self.order], found[:, -self.order :]
        return sparse.hstack([inner, end @ np.ones((self.order, 1))], format="csc")

    def start_coefficients(self, state: Array) -> Array:
        """Return the coefficients of a spline that begins with a state, shape (order,); free coefficients are zero."""
        c = np.zeros(self.count)
        R = self.order
        first = np.stack([D[[0], :R].toarray()[0] for D in self.coefficients_of[:R]])
        c[:R] = np.linalg.solve(first, state[:R])
        return c


def _solve(
    splines: HeldSplines, given: JointTrajectory, joints: Joints, held: Array, backoff: float, until: float
) -> Iterator[Array]:
    """Yield the coefficients of each joint in turn, with limits tightened by `backoff`, relative to their widths.

    End at a joint without a solution, or when the clock `perf_counter` passes `until` [s].
    """
    times, E = subdivide(splines.knots, _LOOKS), splines.free
    free_of_limits = [(sparse.csr_array((1, E.shape[1])), np.ones(1))]
    part = 1 / np.sqrt(2.0 * len(times))
    wanted, design = part * given(times), part * splines.basis(times)
    for j in range(len(joints.names)):
        if perf_counter() > until:
            return
        fixed = splines.start_coefficients(held[:, j])
        at_most = []
        for D, (low, high) in zip(splines.coefficients_of, joints.limits[:, j].tolist(), strict=False):
            if not np.isfinite(low):
                continue
            A, offset, width = sparse.csr_array(D @ E), D @ fixed, high - low
            free = np.diff(A.indptr) > 0
            row, offset = A[free] / width, offset[free] / width
            at_most += [(row, high / width - offset - backoff), (-row, offset - low / width - backoff)]
        found = nearest((design @ E, wanted[:, j] - design @ fixed), [], at_most or free_of_limits)
        if found is None:
            return
        yield fixed + E @ found


def _distances(given: JointTrajectory, found: JointTrajectory) -> dict[str, RepairDistance]:
    """Return how far joints were moved, as seen at many times."""
    times = np.linspace(*given.span, _TIMES)
    apart = (found(times) - given(times)).T
    return {name: RepairDistance.of(of) for name, of in zip(given.names, apart, strict=True)}
