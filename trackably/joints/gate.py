"""A gate for streamed chunks of motion: it lets only proved motion run, which always ends with a proved stop.

A chunk is the next part of a motion, a trajectory of all joints that a planner or a learned policy sends while the
robot moves. The running motion is the proved trajectory that the robot executes.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import KW_ONLY, dataclass, replace
from typing import Any, Literal

import numpy as np

from trackably.arguments import array, instance, positive, real
from trackably.arrays import ArrayLike
from trackably.checker import Failed
from trackably.given.accepted import NotAcceptedError
from trackably.joints.certify import TOLERANCE, CertifiedTrajectory, fit_joints, within_limits
from trackably.joints.limits import Joints
from trackably.joints.repair import beyond_limits
from trackably.joints.trajectory import JointTrajectory, hermite

_CLOSEST = 1e-6  # s: the gate makes no shorter pieces
_STOPS = np.geomspace(0.01, 20.0, 40)
"""Durations of a stop that are tried [s]."""


@dataclass(frozen=True, eq=False)
class GateAnswer:
    """The motion `running` from now on, which is proved for all times and ends at rest, and the `reason` for it.

    `kind` says what runs. "stitched": the chunk, from the time at which the running motion reaches it. "stopped": a
    stop. "kept": the motion that ran before, up to its stop, because no part of the chunk can be run, or no earlier
    stop was found.
    """

    kind: Literal["stitched", "stopped", "kept"]
    running: CertifiedTrajectory
    reason: str


@dataclass(frozen=True, eq=False)
class Gate:
    """Let chunks of motion through to `joints`, as a policy or a planner streams them: `gate(chunk, running, now)`.

    The gate has no state and no clock: each answer contains the running motion, and the caller gives it to the next
    call. Chunks and `now` [s] use the same clock. A new motion begins `lead` [s] after `now`, so that the receiver has
    it in time. If the chunk has another state at that time, a polynomial leads from the running motion to the first
    point of the chunk that it reaches within all limits. Its degree is 2 R − 1, where R is the order of the highest
    limited derivative. At its ends, it has the positions and derivatives below order R of the two motions. A chunk that
    does not end at rest is followed by the shortest stop that keeps all limits, among some durations; if there is none,
    the chunk is cut at an earlier point. Positions of continuous joints may differ by whole turns.

    ValueError: `lead` is negative, or `tolerance` is not positive.
    """

    joints: Joints
    lead: float = 0.0
    _: KW_ONLY
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        instance("gate: joints", self.joints, Joints, "Joints")
        if real("gate: lead", self.lead) < 0:
            raise ValueError(f"gate: lead must not be negative, got {self.lead}")
        positive("gate: tolerance", self.tolerance)

    def at_rest(self, positions: ArrayLike, now: float) -> CertifiedTrajectory:
        """Return the first running motion: joints at rest at positions of shape (J,), from `now` [s] on.

        ValueError: a position is outside its limits, or the shape does not fit.
        """
        q, t = array("gate: positions", positions, len(self.joints.names)), real("gate: now", now)
        if beyond := beyond_limits(self.joints, q[None], excess=0.0):
            raise ValueError(f"gate: no motion can begin here: {beyond[1]}")
        return self._prove(JointTrajectory(self.joints.names, [t, t + 1.0], q[:, None, None]))

    def __call__(self, chunk: Any, running: CertifiedTrajectory, now: float) -> GateAnswer:
        """Return the motion that runs from `now` [s] on, given a chunk in times of the same clock.

        The chunk is an argument of `certify_joints`. ValueError: the chunk has other joints, or `running` does not rest
        at its end or begins after `now`. TypeError: the chunk is no trajectory, or `running` is not proved.
        """
        given, before = fit_joints(chunk, self.joints), self._until(running, now)
        start = before.span[1]
        if given.span[1] <= start + _CLOSEST:
            over = f"the chunk ends at {given.span[1]:.6g} s, but a new motion can begin at {start:.6g} s only"
            return GateAnswer("kept", running, over)
        if (entry := self._entry(self._turn(given, before), before)) is None:
            return GateAnswer("kept", running, "no point of the chunk can be reached")
        if (stopping := self._stopping(entry)) is None:
            return GateAnswer("kept", running, "no stop was found behind the chunk")
        try:
            proved = self._prove(before.followed_by(stopping.breakpoints[1:], stopping.coefficients))
        except NotAcceptedError as refused:
            return GateAnswer("kept", running, f"the chunk is reached, but {_broken(refused)}")
        return GateAnswer("stitched", proved, "the chunk is reached")

    def stop(self, running: CertifiedTrajectory, now: float) -> GateAnswer:
        """Return the shortest stop that is found `lead` after `now` [s]; the running motion if none ends earlier.

        Raises the errors of `__call__` about `running` and `now`.
        """
        before = self._until(running, now)
        stopped = self._braked(before, before.span[1])
        if stopped is not None and stopped.span[1] < running.trajectory.span[1]:
            with suppress(NotAcceptedError):
                return GateAnswer("stopped", self._prove(stopped), "a stop was asked for")
        return GateAnswer("kept", running, "no stop was found that ends before the running motion")

    @property
    def _order(self) -> int:
        return max(self.joints.order, 1)

    def _prove(self, motion: JointTrajectory) -> CertifiedTrajectory:
        return CertifiedTrajectory(replace(motion, rests=True), self.joints, self.tolerance)

    def _until(self, running: CertifiedTrajectory, now: float) -> JointTrajectory:
        """Return the part of the running motion that is executed in any case: up to the start of a new motion.

        A new motion starts `lead` after `now` [s]. The returned part begins with the polynomial piece that holds at
        `now`. Raises the errors of `__call__` about `running` and `now`.
        """
        instance("gate: running", running, CertifiedTrajectory, "a CertifiedTrajectory, from at_rest or from an answer")
        motion, t = running.trajectory, real("gate: now", now)
        if not motion.rests or motion.names != self.joints.names:
            got = f"{', '.join(motion.names)}{'' if motion.rests else ' that does not rest'}"
            raise ValueError(f"gate: expected a running motion of its joints that ends at rest, got one of {got}")
        start, (first, last), ends = t + self.lead, motion.span, motion.breakpoints
        if not first <= t:
            raise ValueError(
                f"gate: expected a running motion that has begun by {t:.9g} s, got one from {first:.9g} s on"
            )
        if start < last + _CLOSEST:
            start = min(start, last)
        begun = ends if start > last else ends[:-1]  # the rest after `last` is a piece too, if `start` gives it a width
        begins = begun[begun <= t][-1]
        start = max(start, begins + _CLOSEST)
        inner = ends[(begins < ends) & (ends < start - _CLOSEST)]
        return replace(motion.on(np.array([begins, *inner, start])), rests=False)

    def _turn(self, given: JointTrajectory, before: JointTrajectory) -> JointTrajectory:
        """Return the chunk `given`, with whole turns added to continuous joints to move it near the end of `before`."""
        t = max(before.span[1], given.span[0])
        turns = np.where(self.joints.is_turning, np.rint((before(before.span[1]) - given(t)) / (2 * np.pi)), 0.0)
        c = given.coefficients.copy()
        c[:, :, 0] += 2 * np.pi * turns[:, None]
        return replace(given, coefficients=c)

    def _entry(self, given: JointTrajectory, before: JointTrajectory) -> JointTrajectory | None:
        """Return a motion from the end of `before`, a part of the running motion, to the end of the chunk `given`.

        None if no point of the chunk can be reached within the limits.
        """
        start, R = before.span[1], self._order
        state = before.state(start, R)
        ends = given.breakpoints
        if ends[0] <= start and np.all(np.abs(given.state(start, R) - state) <= self.tolerance / 2):
            return given.on(np.append(start, ends[ends >= start + _CLOSEST]))
        later = np.flatnonzero(ends > start + _CLOSEST)
        widths = ends[later] - start
        there = given.state(ends[later], R)
        bridges = hermite(np.broadcast_to(state[:, None], there.shape), there, widths)
        open_ = np.flatnonzero(within_limits(bridges, widths, self.joints))
        if not len(open_):
            return None
        k, bridge = later[open_[0]], bridges[:, open_[:1]]
        to_chunk = JointTrajectory(given.names, [start, ends[k]], bridge)
        return to_chunk.followed_by(ends[k + 1 :], given.coefficients[:, k:])

    def _stopping(self, motion: JointTrajectory) -> JointTrajectory | None:
        """Return the motion if it ends at rest; otherwise cut it, and append the shortest stop.

        It is cut at the last end of a piece at which a stop is possible. None if no stop is possible at any of these.
        """
        if np.all(np.abs(motion.at_ends(self._order)[1:, -1]) <= self.tolerance / 2):
            return motion
        return self._braked(motion, motion.span[0])

    def _braked(self, motion: JointTrajectory, since: float) -> JointTrajectory | None:
        """Return a motion up to the last end of a piece at which a stop can begin, and the shortest stop there.

        The stop begins at the time `since` [s] or later. None if no stop keeps the limits.

        The velocity of the stop is the polynomial of least degree that begins with the derivatives of the motion, and
        ends with zeros; the last position follows from it. If no derivative above the velocity is limited, the velocity
        may jump to zero.
        """
        states, ends = motion.at_ends(self._order), motion.breakpoints[1:]
        for k in np.flatnonzero(ends >= since)[::-1]:
            q, *start = np.repeat(states[:, [k]], len(_STOPS), axis=1)
            velocity = hermite(np.array(start), np.zeros_like(start), _STOPS) if start else np.zeros((*q.T.shape, 1))
            c = np.concatenate([q.T[:, :, None], velocity / np.arange(1.0, velocity.shape[2] + 1)], axis=2)
            if len(open_ := np.flatnonzero(within_limits(c, _STOPS, self.joints))[:1]):
                return motion.on(motion.breakpoints[: k + 2]).followed_by(ends[k] + _STOPS[open_], c[:, open_])
        return None


def _broken(refused: NotAcceptedError) -> str:
    """Return which limit a motion is not shown to keep, and where."""
    return refused.verdict.reason.partition(": ")[2] if isinstance(refused.verdict, Failed) else str(refused)
