"""References of nonlinear systems near their bounds, and their certificates."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from mpmath import mp

from tests.trackably.systems.nonlinear_instances import INSTANCES, moving
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove as prove_always
from trackably.gp.kernels.periodic import Periodic
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

END = 3.0


def assert_true(found: Certificate | Counterexample, exactly: Callable[[float], dict], end: float) -> None:
    """What is said is so in many digits.

    A bound is broken at the time that is said; or bounds are kept where float64 sees least room, and at other times
    until the `end` [s], by more than float64 is off.
    """
    reference, times = found.reference, np.linspace(0, end, 20_001)
    with mp.workdps(40):
        if isinstance(found, Counterexample):
            value = exactly(found.time)[found.quantity]
            assert max(found.bounds.lower - value, value - found.bounds.upper) >= found.violation > 0
            return
        worst = [np.argsort(q.margin(reference.signals, times))[:2] for q in reference.quantities]
        for t in times[np.append(worst, np.random.default_rng(0).integers(times.size, size=8))].tolist():
            true = exactly(t)
            for q in reference.quantities:
                value, error = true[q.name], found.evaluation_error[q.name]
                assert min(value - mp.mpf(q.bounds.lower), mp.mpf(q.bounds.upper) - value) >= error
                assert abs(mp.mpf(q(reference.signals, np.array(t)).item()) - value) <= error < 1e-6 * q.bounds.width


def tight(name: str, end: float = END, room: float = 1e-3, centres: int = 3) -> Reference:
    """Bounds that are touched but for a part of their width; the rest lies inside."""
    loose = moving(INSTANCES[name], seed=3, centres=centres)
    return bounded(loose, np.linspace(0, end, 2001), room)


def bounded(reference: Reference, times: np.ndarray, room: float) -> Reference:
    means, boxes = [signal.mean for signal in reference.signals], []
    at_rest = [q.at_rest(means) for q in reference.plant.flatness.inputs]
    for values, rest in ((reference.state_at(times), means), (reference.input_at(times), at_rest)):
        low, high = np.minimum(values.min(0), rest), np.maximum(values.max(0), rest)
        width = high - low
        below, above = (room * width + 1e-2 * (end == rest) * width for end in (low, high))
        boxes.append(Polytope.box(low - below, high + above))
    return replace(reference, plant=replace(reference.plant, state_set=boxes[0], input_set=boxes[1]))


@cache
def proved(name: str) -> Certificate:
    found = prove_always(tight(name, room=1e-2, centres=2))
    assert isinstance(found, Certificate), found.explanation
    return found


def periodic() -> Reference:
    loose = moving(INSTANCES["tank"])
    signal = replace(loose.signals[0], kernel=Periodic(1.0, 1.5, 2.0))
    return bounded(replace(loose, signals=(signal,)), np.linspace(0, 2.0, 2001), 1e-3)


def with_states(name: str, lower: float, upper: float = 9.0, **change: float) -> Reference:
    """A reference of one state between these bounds, with wide bounds of its input."""
    reference = moving(INSTANCES[name], **change)
    sets = {"state_set": Polytope.box([lower], [upper]), "input_set": Polytope.box([-99.0], [99.0])}
    return replace(reference, plant=replace(reference.plant, **sets))
