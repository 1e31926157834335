"""Attack gates of joints: `python -m tests.attack.joints --chunks 10000 --seed 0`.

Chunks jump, come late, leave gaps, or are out of reach; what runs is looked at on a fine grid, without the library's
own polynomials where these are not needed. Exit code 1 if anything false passed.
"""

import sys
from collections import Counter

import numpy as np

from tests.attack.command import run
from tests.trackably.joints.trajectories import ORDERS
from trackably import CertifiedTrajectory, Gate, Joints, JointTrajectory

_NAMES = ("a", "b", "c")
_GRID = 800


class Stream:
    """A policy that streams chunks to a gate, with all that may go wrong; `false` is what was seen to be wrong."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        order = int(self.rng.integers(1, 4))
        chosen = dict([("velocity", 2.0), ("acceleration", 10.0), ("jerk", 200.0)][:order])
        turning = self.rng.random() < 0.3
        position = None if turning else [(-1.5, 1.5)] * 3
        self.joints = Joints(position=position, names=_NAMES, continuous=turning, **chosen)
        self.gate = Gate(self.joints, lead=float(self.rng.choice([0.0, 0.01, 0.05])))
        self.now = float(self.rng.uniform(0, 100))
        self.running = self.gate.at_rest(self.rng.uniform(-1, 1, 3), self.now)
        self.kinds: Counter[str] = Counter()
        self.false: list[str] = []

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
        before = self.running
        answer = self.gate.stop(before, self.now) if self.rng.random() < 0.05 else self.gate(given, before, self.now)
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


def attack_gates(chunks: int, seed: int) -> tuple[str, list[str]]:
    """Let fifty chunks come to each gate."""
    streams = [Stream(1000 * seed + number) for number in range(chunks // 50)]
    for stream in streams:
        for _ in range(50):
            stream.step()
    said = _told(sum((stream.kinds for stream in streams), Counter[str]()))
    return said, [why for stream in streams for why in stream.false]


def _told(counts: Counter[str]) -> str:
    return "".join(f"\n{count:6d}  {what}" for what, count in sorted(counts.items()))


if __name__ == "__main__":
    sys.exit(run("tests.attack.joints", {"chunks": (10_000, attack_gates)}, sys.argv[1:]))
