"""Attack verdicts about joints: `python -m tests.attack.joints --trajectories 2000 --chunks 10000 --seed 0`.

Trajectories are next to a limit, by 1e-6 of it or less, in all interpolations; their extremes are found in 50 digits.
Chunks jump, come late, leave gaps, or are out of reach; what runs is looked at on a fine grid, without the library's
own polynomials where these are not needed. Exit code 1 if anything false passed.
"""

import sys
import time
from collections import Counter
from fractions import Fraction

import numpy as np
from scipy.interpolate import CubicSpline

from tests.attack.command import run
from tests.attack.truth import largest
from tests.trackably.joints.trajectories import ORDERS
from trackably import BrokenLimits, CertifiedTrajectory, Gate, Joints, JointTrajectory, certify_joints

_NAMES = ("a", "b", "c")
_INTERPOLATIONS = ("linear", "cubic", "quintic", "upsampled", "spline")
_FIELDS = {"linear": 1, "cubic": 2, "quintic": 3}
_GRID = 800


def random_trajectory(rng: np.random.Generator, how: str) -> JointTrajectory:
    """Return a trajectory of one joint through random points, as one of the interpolations has it."""
    n = int(rng.integers(3, 9))
    t = np.cumsum(rng.uniform(0.02, 0.5, n))
    q, v, a = (scale * rng.normal(size=(n, 1)) for scale in (0.3, 1.0, 5.0))
    if how in _FIELDS:
        return JointTrajectory.through(t, *(q, v, a)[: _FIELDS[how]], rests=False)
    if how == "upsampled":
        return JointTrajectory.through(t, q, upsampled=True, rests=False)
    return JointTrajectory.of(CubicSpline(t, q), rests=False)


def attack_trajectory(rng: np.random.Generator, counts: Counter[str]) -> str | None:
    """Ask for a verdict about a trajectory whose extreme is next to its limit; return what is false in it."""
    how = str(rng.choice(_INTERPOLATIONS))
    given = random_trajectory(rng, how)
    order = int(rng.integers(0, _FIELDS.get(how, 3) + 1))
    most = largest(given, order)
    part = float(rng.choice([-1, 1]) * 10.0 ** rng.uniform(-12, -6))
    upper = float(most) + part * max(abs(float(most)), 1e-3)
    limit = {ORDERS[order]: [(-1e12, upper)]}
    answer = certify_joints(given, Joints(names=given.names, **limit), tolerance=1e9)  # jumps are another matter
    kept, what = most <= upper, type(answer).__name__
    counts[f"{how}, {ORDERS[order]}: {what}"] += 1
    if what != ("CertifiedTrajectory" if kept else "BrokenLimits"):
        return f"{how}, {ORDERS[order]}: {what}, although the extreme is {float(most)!r} and the limit {upper!r}"
    if isinstance(answer, BrokenLimits) and not answer.first.violation <= (by := most - Fraction(upper)):
        return f"{how}, {ORDERS[order]}: broken by {answer.first.violation!r}, and not by {float(by)!r}"
    return None


class Stream:
    """A policy that streams chunks to a gate, with all that may go wrong; `false` is what was seen to be wrong."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        order = int(self.rng.integers(1, 4))
        chosen = dict([("velocity", 2.0), ("acceleration", 10.0), ("jerk", 200.0)][:order])
        turning = self.rng.random() < 0.3
        position = None if turning else [(-1.5, 1.5)] * 3
        self.joints = Joints(position=position, names=_NAMES, continuous=turning, **chosen)
        self.gate = Gate(self.joints, lead=float(self.rng.choice([0.0, 0.01, 0.05])), budget=1.0)
        self.now = float(self.rng.uniform(0, 100))
        self.running = self.gate.at_rest(self.rng.uniform(-1, 1, 3), self.now)
        self.kinds: Counter[str] = Counter()
        self.false: list[str] = []
        self.seconds: list[float] = []

    def chunk(self) -> tuple[JointTrajectory, str]:
        """Return the next chunk, and what is wrong with it."""
        rng, order = self.rng, self.joints.order
        what = str(rng.choice(["near", "near", "near", "jump", "late", "gap", "fast", "far", "short"]))
        start = self.now + {"late": -rng.uniform(0, 1.5), "gap": rng.uniform(0.1, 2.0)}.get(what, 0.0)
        n = 2 if what == "short" else int(rng.integers(5, 40))
        t = start + np.cumsum(np.append(0.0, rng.uniform(0.01, 0.05, n - 1)))
        here = self.running.trajectory(max(start, self.now))
        speed = rng.uniform(-0.5, 0.5, 3) * (20 if what == "fast" else 1)
        offset = {"jump": rng.normal(size=3) * 0.3, "far": rng.normal(size=3) * 5}.get(what, np.zeros(3))
        x = t[:, None] - start
        q = here + offset + speed * (1 - np.exp(-3 * x)) + 0.002 * rng.normal(size=(n, 3)) * (what == "near")
        v = np.gradient(q, t, axis=0) if n > 2 else np.zeros(q.shape)
        fields = [q, v, np.zeros(q.shape)][: max(order, 1)]
        return JointTrajectory.through(t, *fields, names=_NAMES, rests=bool(rng.random() < 0.5)), what

    def step(self) -> None:
        """Let one chunk come, look at what runs then, and let time pass."""
        given, what = self.chunk()
        before, began = self.running, time.perf_counter()
        answer = self.gate.stop(before, self.now) if self.rng.random() < 0.05 else self.gate(given, before, self.now)
        self.seconds.append(time.perf_counter() - began)
        self.kinds[f"{what}: {answer.kind}"] += 1
        self.running = answer.running
        self.false += [f"{what}: {answer.kind}: {why}" for why in self._wrong(before, answer.running)]
        self.now += float(self.rng.choice([0.02, 0.1, 0.5, 3.0]) * self.rng.uniform(0.5, 1.5))

    def _wrong(self, before: CertifiedTrajectory, after: CertifiedTrajectory) -> list[str]:
        found, motion = [], after.trajectory
        if not motion.rests:
            found.append("no stop behind the end")
        until = self.now + self.gate.lead
        t = np.linspace(self.now, until, 9)[:-1]
        if np.max(np.abs(motion(t) - before.trajectory(t)), initial=0.0) > 1e-12:
            found.append("what runs before the lead is over has changed")
        t = np.linspace(self.now, motion.span[1] + 0.1, _GRID)
        for r in range(self.joints.order + 1):
            x, (low, high) = motion(t, r), self.joints.limits[r].T
            if np.any(x < low - 1e-9 * (1 + np.abs(x))) or np.any(x > high + 1e-9 * (1 + np.abs(x))):
                found.append(f"the {ORDERS[r]} is outside")
        ends = motion.breakpoints[motion.breakpoints > self.now]
        for r in range(self.joints.order):
            step = 1e-9
            jump = np.abs(motion(ends + step, r) - motion(ends - step, r))
            rate = np.minimum(np.max(np.abs(self.joints.limits[r + 1]), axis=1), 1e4)
            if np.any(jump > 1e-7 + 4 * step * rate):
                found.append(f"the {ORDERS[r]} jumps by {np.max(jump):.3g}")
        return found


def attack_trajectories(count: int, seed: int) -> tuple[str, list[str]]:
    """Ask about random trajectories, one after the other."""
    counts, rng = Counter[str](), np.random.default_rng(seed)
    false = [why for _ in range(count) if (why := attack_trajectory(rng, counts))]
    return _told(counts), false


def attack_gates(chunks: int, seed: int) -> tuple[str, list[str]]:
    """Let fifty chunks come to each gate."""
    streams = [Stream(1000 * seed + number) for number in range(chunks // 50)]
    for stream in streams:
        for _ in range(50):
            stream.step()
    seconds = 1e3 * np.array([taken for stream in streams for taken in stream.seconds])
    said = _told(sum((stream.kinds for stream in streams), Counter[str]()))
    said += f"\ngate: median {np.median(seconds):.1f} ms, 99 % {np.quantile(seconds, 0.99):.1f} ms"
    return said, [why for stream in streams for why in stream.false]


def _told(counts: Counter[str]) -> str:
    return "".join(f"\n{count:6d}  {what}" for what, count in sorted(counts.items()))


ATTACKS = {"trajectories": (2_000, attack_trajectories), "chunks": (10_000, attack_gates)}

if __name__ == "__main__":
    sys.exit(run("tests.attack.joints", ATTACKS, sys.argv[1:]))
