"""Whether what a file says is true, by searches that look at nothing that the checker looks at."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
from mpmath import mp

from tests.trackably.certificates import naive
from tests.trackably.certificates.decoded import claim_of, decode_certificate
from tests.trackably.checker.truth import as_stored, is_true, statement
from tests.trackably.joints.trajectories import extreme
from tests.trackably.systems.redundant_instances import excess
from trackably.arrays import Array
from trackably.checker.certificate import SignalClass, TrueSignal
from trackably.codec import decode
from trackably.joints.trajectory import JointTrajectory
from trackably.reference.truth import Signals
from trackably.systems.reference import Reference

_TOLERANCE = 1e-9


def is_kept(data: dict) -> bool:
    """Whether all bounds are kept, with room for rounding; by refined extremes, in many digits."""
    return is_true(statement(data))


def is_kept_by_formulas(data: dict) -> bool:
    """The same of a nonlinear system, on a dense grid in float64."""
    certificate = decode_certificate(data)
    reference, times = certificate.reference, np.linspace(0.0, 5.0, 20_001)
    return all(
        float(np.min(q.margin(reference.signals, times))) >= 0.99 * certificate.evaluation_error[q.name]
        for q in reference.quantities
    )


def input_exists(data: dict) -> bool:
    """Whether some input in U acts as u(t) does, at the times at which single inputs are largest and smallest."""
    reference = as_stored(decode_certificate(data).reference, data["trajectories"])
    grid = np.linspace(0.0, 15.0, 2001)
    plant = reference.plant
    inputs = np.stack([q(reference.signals, grid) for q in plant.flatness.inputs], axis=-1)
    chosen = {int(i) for i in (*inputs.argmin(axis=0), *inputs.argmax(axis=0))}
    return all(excess(plant.linear, plant.input_set, inputs[i]) <= _TOLERANCE for i in chosen)


def is_broken(data: dict) -> bool:
    """Whether the bound is broken by what is said, at a time that is claimed, and the system follows the reference."""
    reference = as_stored(decode(Reference, _widened(data["reference"])), data["trajectories"])
    claim, at, plant = data["claim"], data["at"], data["reference"]["plant"]
    start, end = claim_of(claim).span
    t = naive.instant(reference, at["step"]) if "step" in at else at["time"]
    is_claimed = start <= t <= end and ("step" in at) == (claim["kind"] == "instants")
    i = [q.name for q in reference.quantities].index(data["quantity"])
    lower, upper = ([*plant["state_set"][side], *plant["input_set"][side]][i] for side in ("lower", "upper"))
    with mp.workdps(naive.DIGITS):
        value = naive.exactly(reference, data["quantity"], t)
        off = max(mp.mpf(lower) - value, value - mp.mpf(upper))
    return bool(is_claimed and naive.follows_exactly(reference) and off >= data["violation"] > 0)


def _widened(reference: dict) -> dict:
    """The same with sets that have an interior: nothing lies in an empty one, which the library refuses to hold."""
    plant = dict(reference["plant"])
    for side in ("state_set", "input_set"):
        count = len(plant[side]["rows"])
        plant[side] = {**plant[side], "lower": [-1e9] * count, "upper": [1e9] * count}
    return {**reference, "plant": plant}


def largest(given: JointTrajectory, order: int, side: int = 1) -> Fraction:
    """Return the largest value of a derivative of one joint, or of what is opposite to it (`side` −1), in 80 digits."""
    rows = side * given.coefficients
    return extreme({"trajectory": {"breakpoints": given.breakpoints.tolist(), "coefficients": rows.tolist()}}, 0, order)


def distance(of: SignalClass, x: float, at: float, cells: int = 4) -> float:
    """Return how far from x a signal of the class is at a time [s], by a linear program; 0 if it finds none."""
    signals = Signals.of(of, (at,), cells)
    return max(abs(found[0] - x) if (found := signals.extreme(at, sign)) else 0.0 for sign in (1, -1))


def distances(found: Any, truth: TrueSignal, f: Callable[[Array], Array]) -> tuple[Array, Array, Array]:
    """Return times [s] of what is claimed, the distance of the position from f there, and the distance that is said."""
    t = np.linspace(truth.ends[0], truth.ends[-1], 2001)
    cell = np.searchsorted(truth.ends, t, side="right") - 1
    return t, np.abs(found.reference.state_at(t)[:, 0] - f(t)), np.array([*truth.errors, truth.errors[-1]])[cell]
