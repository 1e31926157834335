"""Hundreds of disturbed runs of the tube controller from inside of its tube, at once."""

import numpy as np

from pipeline.loops.disturbances import Constant, Drawn, Greedy
from trackably.arrays import Array
from trackably.control.loop_trajectory import Runs
from trackably.control.stepping import Disturbances
from trackably.systems.disturbance.invariant import InvariantSet
from trackably.systems.disturbance.tightening import Tightening
from trackably.systems.reference import Window

COUNT, KEPT = 300, 9
_WARM_UP = 60


def disturbances(kind: str, drawn_in: Tightening, seed: int) -> Disturbances:
    """Return disturbances of W of this kind: drawn, greedy or constant."""
    W, rng = drawn_in.disturbance, np.random.default_rng(seed)
    assert W is not None, "loops are disturbed where there is a set"
    if kind == "greedy":
        return Greedy(W, drawn_in.given.state_set)
    return Drawn(W, seed) if kind == "drawn" else Constant(W, rng.standard_normal(W.dimension))


def noise(drawn_in: Tightening, seed: int) -> Disturbances | None:
    """Return noise drawn from V, if the state is measured with noise; it has nothing to do with disturbances drawn."""
    return None if drawn_in.noise is None else Drawn(drawn_in.noise, 10**6 + seed)


def start(Z: InvariantSet, seed: int) -> Array:
    """Return an error (n,) in Z that disturbances have caused."""
    rng, e = np.random.default_rng(seed), np.zeros(Z.disturbance.dimension)
    for _ in range(_WARM_UP):
        e = Z.closed_loop @ e + Z.disturbance.farthest(rng.standard_normal(len(e)))
    return np.asarray(e)


def many_runs(drawn_in: Tightening, window: Window, first_step: int) -> tuple[Runs, int]:
    """Return runs along the window of a robust reference, and how often a bound was broken in them.

    The measured state begins in x_r ⊕ Z. There the tube controller applies u = u_r + K (y − x_r): its plan is the
    reference, and no program is solved. Every third run has drawn, greedy or constant disturbances; noise is drawn.
    """
    runs = np.array([_run(drawn_in, window, first_step, r) for r in range(COUNT)])
    n, given = window.states.shape[1], drawn_in.given
    broken = np.sum(given.state_set.margin(runs[:, 1:, :n]) < 0) + np.sum(given.input_set.margin(runs[..., n:]) < 0)
    steps = first_step + np.arange(runs.shape[1], dtype=float)
    return Runs(steps, runs.min(axis=0), runs.max(axis=0), runs[:KEPT]), int(broken)


def _run(drawn_in: Tightening, window: Window, first_step: int, r: int) -> Array:
    """Return states and inputs (K, n + m) of one run."""
    Z, system = drawn_in.invariant, drawn_in.given.linear
    assert Z is not None, "loops are disturbed where there is a set"
    pushed, measured = disturbances(("drawn", "greedy", "constant")[r % 3], drawn_in, r), noise(drawn_in, r)
    y, x, course = window.states[0] + start(Z, r), None, []
    for k, (x_r, u_r) in enumerate(zip(window.states, window.inputs, strict=False)):
        v = np.zeros(len(x_r)) if measured is None else measured(first_step + k, x_r)
        x = y - v if x is None else x
        u = u_r + Z.feedback @ (x + v - x_r)
        course.append(np.concatenate([x, u]))
        successor = system.successor(x, u)
        x = successor + pushed(first_step + k, successor)
    return np.array(course)
