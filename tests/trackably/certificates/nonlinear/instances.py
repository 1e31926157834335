"""References of nonlinear systems near their bounds, and their certificates."""

from dataclasses import replace
from functools import cache

import numpy as np

from tests.trackably.systems.nonlinear_instances import INSTANCES, exactly, moving
from trackably.certificates.certificate import Certificate
from trackably.certificates.prove import prove as prove_always
from trackably.gp.kernels.periodic import Periodic
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

END = 3.0
BOX = Polytope.box
WIDE = BOX([-99.0], [99.0])


def true_values(name: str, reference: Reference, times) -> dict[str, list]:
    """Of every state and input, in many digits."""
    found = [exactly(INSTANCES[name], reference, t) for t in times]
    return {q: [values[q] for values in found] for q in found[0]}


def tight(name: str, end: float = END, room: float = 1e-3, centres: int = 3) -> Reference:
    """Bounds that are touched but for a part of their width; the rest lies inside."""
    loose = moving(INSTANCES[name], seed=3, centres=centres)
    return bounded(loose, np.linspace(0, end, 2001), room)


def bounded(reference: Reference, times: np.ndarray, room: float) -> Reference:
    boxes = []
    for values, rest in (
        (reference.state_at(times), [q.mean for q in reference.signals]),
        (reference.input_at(times), [q.at_rest([s.mean for s in reference.signals])
                                     for q in reference.plant.flatness.inputs]),
    ):  # fmt: skip
        low, high = (np.minimum(values.min(0), rest), np.maximum(values.max(0), rest))
        width = high - low
        boxes.append(Polytope.box(low - room * width - 1e-2 * (low == rest) * width,
                                  high + room * width + 1e-2 * (high == rest) * width))  # fmt: skip
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


def with_sets(name: str, states: Polytope, inputs: Polytope, **change: float) -> Reference:
    reference = moving(INSTANCES[name], **change)
    return replace(reference, plant=replace(reference.plant, state_set=states, input_set=inputs))
