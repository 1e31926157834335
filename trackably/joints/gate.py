"""A gate for streamed chunks of motion: it only lets proved motion run, and a proved stop follows the end of it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from time import perf_counter
from typing import Any, Literal

import numpy as np

from trackably.arguments import array, instance, positive, real
from trackably.arrays import Array, ArrayLike
from trackably.given.accepted import NotAcceptedError
from trackably.given.conversion import shift
from trackably.joints.certify import TOLERANCE, CertifiedTrajectory, fit_joints, room
from trackably.joints.limits import Joints
from trackably.joints.repair import repair_joints
from trackably.joints.trajectory import JointTrajectory, at_ends, hermite, join, on_pieces

_CLOSEST = 1e-6  # s; pieces are no shorter
_SHORTEST, _LONGEST, _STOPS = 0.01, 20.0, 40
"""Shortest and longest duration of a stop [s], and the number of durations tried."""


@dataclass(frozen=True, eq=False)
class GateAnswer:
    """The motion `running` from now on, proved for all times and at rest after its end, and the `reason` for it.

    `kind` is "stitched": the chunk, from the time at which the running motion joins it; "repaired": the motion nearest
    to the chunk that can be reached from the running one; "stopped": a stop; "kept": the motion that ran before, up to
    its stop, because nothing of the chunk can be run.
    """

    kind: Literal["stitched", "repaired", "stopped", "kept"]
    running: CertifiedTrajectory
    reason: str


@dataclass(frozen=True, eq=False)
class Gate:
    """Let chunks of motion through to `joints`, as a policy or a planner streams them: `gate(chunk, running, now)`.

    The gate has no state and no clock: the running motion is a value that an answer contains and the next call takes.
    Chunks and `now` [s] use the same clock. A new motion begins `lead` [s] after `now`, so that the receiver has it in
    time. If the chunk is elsewhere at that time, the running motion joins it by one polynomial of degree 2 R − 1 for
    limits up to order R, with the derivatives of both below order R at its ends. It joins at the first point of the
    chunk for which the polynomial keeps all limits. A chunk that does not end at rest is followed by the shortest stop,
    among some durations, that keeps all limits; if there is none, the chunk is cut at an earlier point. Positions of
    continuous joints may differ by whole turns. If all this fails, quadratic programs look for the nearest motion
    (`repair_joints`), as long as `budget` [s] of computation is not used up.

    ValueError: `lead` is negative, or `budget` or `tolerance` is not positive.
    """

    joints: Joints
    lead: float = 0.0
    budget: float = 0.3
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        instance("gate: joints", self.joints, Joints, "Joints")
        if real("gate: lead", self.lead) < 0:
            raise ValueError(f"gate: lead must not be negative, got {self.lead}")
        for name in ("budget", "tolerance"):
            positive(f"gate: {name}", getattr(self, name))

    def at_rest(self, positions: ArrayLike, now: float) -> CertifiedTrajectory:
        """Return the first running motion: joints at rest at positions of shape (J,), from `now` [s] on.

        ValueError: a position is outside its limits, or the shape does not fit.
        """
        q, t = array("gate: positions", positions, len(self.joints.names)), real("gate: now", now)
        for name, at, (low, high) in zip(self.joints.names, q.tolist(), self.joints.position.tolist(), strict=True):
            if not low <= at <= high:
                raise ValueError(f"gate: the position of {name} must be in [{low:g}, {high:g}], got {at:g}")
        return self._prove(t + np.array([0.0, 1.0]), q[:, None, None])

    def __call__(self, chunk: Any, running: CertifiedTrajectory, now: float) -> GateAnswer:
        """Return the motion that runs from `now` [s] on, given a chunk in times of the same clock.

        The chunk is an argument of `certify_joints`. ValueError: the chunk has other joints, or `running` does not rest
        at its end or begins after `now`. TypeError: the chunk is no trajectory, or `running` is not proved.
        """
        began, given = perf_counter(), fit_joints(chunk, self.joints)
        before = self._until(running, now)
        start = before.span[1]
        if given.span[1] <= start + _CLOSEST:
            return GateAnswer("kept", running, f"the chunk ends at {given.span[1]:.6g} s, and {start:.6g} s is over")
        given = self._turn(given, before)
        reason = "no point of the chunk can be reached"
        if (entry := self._entry(given, before)) is not None:
            found = self._stopping(*entry)
            if found is None:
                reason = "no stop was found behind the chunk"
            else:
                try:
                    return GateAnswer("stitched", self._prove(*_continue(before, *found)), "the chunk is reached")
                except NotAcceptedError as refused:
                    reason = str(refused)
        left = self.budget - (perf_counter() - began)
        if left > 0 and (repaired := self._repair(given, before, left)) is not None:
            return GateAnswer("repaired", repaired, reason)
        return GateAnswer("kept", running, reason)

    def stop(self, running: CertifiedTrajectory, now: float) -> GateAnswer:
        """Return the shortest stop that begins `lead` after `now` [s], or the running motion up to its own.

        Raises as a call.
        """
        before = self._until(running, now)
        end = self._brake(before.state(before.span[1], self._order)[:, None], before.breakpoints[-1:])
        if end is not None and before.span[1] + end[0][0] < running.trajectory.span[1]:
            with suppress(NotAcceptedError):
                found = self._prove(*_continue(before, before.span[1] + np.append(0.0, end[0]), end[1]))
                return GateAnswer("stopped", found, "asked for")
        return GateAnswer("kept", running, "no stop is shorter than the one that is proved")

    @property
    def _order(self) -> int:
        return max(self.joints.order, 1)

    def _prove(self, ends: Array, c: Array) -> CertifiedTrajectory:
        return CertifiedTrajectory(JointTrajectory(self.joints.names, ends, c), self.joints, self.tolerance)

    def _until(self, running: CertifiedTrajectory, now: float) -> JointTrajectory:
        """Return the running motion from the piece at `now` up to the earliest time [s] at which
        a new one may begin.
        """
        instance("gate: running", running, CertifiedTrajectory, "a CertifiedTrajectory, as of at_rest or of an answer")
        motion, t = running.trajectory, real("gate: now", now)
        if not motion.rests or motion.names != self.joints.names:
            raise ValueError("gate: the running motion must end at rest, and have the joints of the gate")
        start, (first, last) = t + self.lead, motion.span
        if not first <= t:
            raise ValueError(f"gate: the running motion begins at {first:.9g} s, after now, {t:.9g} s")
        ends, c = motion.breakpoints, motion.coefficients
        if start >= last + _CLOSEST:  # at rest
            q = np.zeros((*c.shape[:1], 1, c.shape[2]))
            q[:, 0, 0] = motion(last)
            ends, c = np.append(ends, start), np.concatenate([c, q], axis=1)
        start = min(start, float(ends[-1]))
        i = int(np.clip(np.searchsorted(ends, min(t, last), side="right") - 1, 0, len(ends) - 2))
        k = max(int(np.searchsorted(ends, start - _CLOSEST, side="left")), i + 1)
        start = max(start, float(ends[k - 1]) + _CLOSEST)
        return JointTrajectory(motion.names, np.append(ends[i:k], start), c[:, i:k], rests=False)

    def _turn(self, given: JointTrajectory, before: JointTrajectory) -> JointTrajectory:
        """Return a chunk with continuous joints moved by whole turns to near their current positions."""
        t = max(before.span[1], given.span[0])
        turns = np.where(self.joints.is_turning, np.rint((before(before.span[1]) - given(t)) / (2 * np.pi)), 0.0)
        c = given.coefficients.copy()
        c[:, :, 0] += 2 * np.pi * turns[:, None]
        return JointTrajectory(given.names, given.breakpoints, c, given.rests)

    def _entry(self, given: JointTrajectory, before: JointTrajectory) -> tuple[Array, Array] | None:
        """Return breakpoints and pieces from the end of the running motion to the end of the chunk.

        None if there is no way.
        """
        start, R = before.span[1], self._order
        state = before.state(start, R)
        ends = given.breakpoints
        if ends[0] <= start and np.all(np.abs(given.state(start, R) - state) <= self.tolerance / 2):
            k = int(np.searchsorted(ends, start + _CLOSEST, side="left"))
            first = shift(given.coefficients[:, k - 1], start - ends[k - 1])[:, None]
            return np.append(start, ends[k:]), np.concatenate([first, given.coefficients[:, k:]], axis=1)
        (later,) = np.nonzero(ends > start + _CLOSEST)
        widths = ends[later] - start
        there = np.stack([given(ends[later], r) for r in range(R)])  # (R, M, J)
        bridges = hermite(np.broadcast_to(state[:, None], there.shape), there, widths)
        (open_,) = np.nonzero(room(bridges, widths, self.joints) >= 0)
        if not len(open_):
            return None
        k = later[open_[0]]
        bridge, rest = bridges[:, open_[0], None], given.coefficients[:, k:]
        return np.append(start, ends[k:]), join([bridge, rest], 1)

    def _stopping(self, ends: Array, c: Array) -> tuple[Array, Array] | None:
        """Return pieces that end at rest, by a stop after the last piece from which one is possible."""
        R = self._order
        states = at_ends(ends, c, R)
        if np.all(np.abs(states[1:, -1]) <= self.tolerance / 2):
            return ends, c
        for some in (slice(-1, None), slice(None)):  # the end first, which nearly always does
            stop = self._brake(states[:, some], ends[1:][some])
            if stop is not None:
                widths, pieces, at = stop
                last = len(ends) - 1 if some.start == -1 else at + 1
                return np.append(ends[: last + 1], ends[last] + widths), join([c[:, :last], pieces], 1)
        return None

    def _brake(self, states: Array, ends: Array) -> tuple[Array, Array, int] | None:
        """Return the duration [s] and the pieces of a stop, and the index of its start: the last
        possible of states (R, M, J).

        The velocity is the polynomial of least degree with the derivatives of both ends; the end position follows. If
        only velocities are limited, they may jump, and a stop takes the shortest duration.
        """
        R, M, J = states.shape
        widths = np.tile(np.geomspace(_SHORTEST, _LONGEST, _STOPS), M)
        of = np.repeat(np.arange(M), _STOPS)
        start = states[1:, of]
        velocity = hermite(start, np.zeros_like(start), widths) if R > 1 else np.zeros((J, len(of), 1))
        powers = np.arange(1.0, velocity.shape[2] + 1)
        c = np.concatenate([states[0, of].T[:, :, None], velocity / powers], axis=2)
        (open_,) = np.nonzero(room(c, widths, self.joints) >= 0)
        if not len(open_):
            return None
        best = open_[of[open_] == of[open_[-1]]][0]
        return widths[[best]], c[:, [best]], int(of[best])

    def _repair(self, given: JointTrajectory, before: JointTrajectory, left: float) -> CertifiedTrajectory | None:
        """Return the motion nearest to a chunk from the end of the running one, with time for a stop after it."""
        start, R = before.span[1], self._order
        state = before.state(start, R)
        ends = np.unique([start, *given.breakpoints[given.breakpoints > start + _CLOSEST]])
        pause = max(0.5 * (ends[-1] - ends[0]), 0.1)
        ends = np.append(ends, ends[-1] + pause * np.array([0.5, 1.0]))
        c = on_pieces(ends, given.breakpoints, given.coefficients)
        for k in np.flatnonzero((ends[:-1] >= given.span[1] - _CLOSEST) | (ends[1:] <= given.span[0] + _CLOSEST)):
            c[:, k], c[:, k, 0] = 0.0, given(np.clip(ends[k], *given.span))
        wanted = JointTrajectory(self.joints.names, ends, c)
        found = repair_joints(wanted, self.joints, state, self.tolerance / 4, left)
        if isinstance(found, CertifiedTrajectory):
            with suppress(NotAcceptedError):
                return self._prove(*_continue(before, found.trajectory.breakpoints, found.trajectory.coefficients))
        return None


def _continue(before: JointTrajectory, ends: Array, c: Array) -> tuple[Array, Array]:
    """Return a motion followed by further pieces."""
    return np.concatenate([before.breakpoints, ends[1:]]), join([before.coefficients, c], 1)
