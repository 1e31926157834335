"""How long joints' chunks take: `python -m benchmarks.chunks [COUNT]`; seven joints, fifty points, limits up to jerk.

Processor time and time by the clock of proof and check, of the gate with stitching, and of repairs: medians and 99th
percentiles on one thread.
"""

import sys
from collections.abc import Callable, Iterator
from functools import partial
from time import perf_counter, process_time
from typing import TypeVar

import numpy as np
from scipy.interpolate import make_interp_spline
from threadpoolctl import threadpool_limits

from trackably import Gate, Joints, JointTrajectory, certify_joints, repair_joints

T = TypeVar("T")
NAMES = tuple(f"joint{j + 1}" for j in range(7))
POINTS, EVERY = 50, 0.02  # s
ARM = Joints(position=[(-2.9, 2.9)] * 7, velocity=2.0, acceleration=10.0, jerk=300.0, names=NAMES)


def chunks(count: int, seed: int = 0) -> Iterator[tuple[float, JointTrajectory]]:
    """Yield times and quintic splines of a policy that corrects itself by some millimetres from chunk to chunk."""
    rng = np.random.default_rng(seed)
    rates, sizes = rng.uniform(0.5, 1.5, 7), rng.uniform(0.1, 0.5, 7)
    now = 0.0
    for _ in range(count):
        t = now + EVERY * np.arange(POINTS)
        q = sizes * np.sin(np.outer(t, rates)) + 0.002 * rng.normal(size=7)
        yield now, JointTrajectory.of(make_interp_spline(t, q, k=5), NAMES, rests=False)
        now += float(rng.uniform(0.1, 0.5))


Times = dict[str, list[tuple[float, float]]]


def measured(run: Callable[[], T], name: Callable[[T], str], times: Times) -> T:
    """Return what a function does, and note by name how long it takes [s]: of the processor, and by the clock."""
    began = process_time(), perf_counter()
    found = run()
    times.setdefault(name(found), []).append((process_time() - began[0], perf_counter() - began[1]))
    return found


def main(count: int) -> None:
    """Measure, and print a table."""
    gate, times = Gate(ARM, lead=0.02), Times()
    running = gate.at_rest(np.zeros(7), 0.0)
    for now, chunk in chunks(count):
        measured(partial(certify_joints, chunk, ARM), lambda found: f"proof and check: {type(found).__name__}", times)
        answer = measured(partial(gate, chunk, running, now), lambda found: f"gate: {found.kind}", times)
        running = answer.running
    tight = Joints(position=[(-2.9, 2.9)] * 7, velocity=0.3, acceleration=1.0, jerk=30.0, names=NAMES)
    for now, chunk in chunks(max(count // 10, 1), seed=1):
        start = [chunk(now)]  # at rest
        measured(partial(repair_joints, chunk, tight, start), lambda found: f"repair: {type(found).__name__}", times)
    head = "| what | count | median [ms] | 99 % [ms] | median, clock [ms] | 99 %, clock [ms] |"
    print(f"{head}\n|---|--:|--:|--:|--:|--:|")
    for name, each in times.items():
        of = 1e3 * np.array(each)
        cells = [f"{value:.1f}" for k in (0, 1) for value in (np.median(of[:, k]), np.quantile(of[:, k], 0.99))]
        print(f"| {name} | {len(each)} | {' | '.join(cells)} |")


if __name__ == "__main__":
    with threadpool_limits(limits=1):
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
