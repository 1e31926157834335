"""Whether what a certificate says is true, by a dense search that looks at no box."""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

from tests.splines.naive import extremes
from tests.trackably.certificates import naive
from tests.trackably.certificates.decoded import decode_certificate
from tests.trackably.checker.test_soundness import smallest_margin
from trackably.certificates.certificate import Certificate
from trackably.systems.linear import Flatness
from trackably.systems.reference import Quantity, Reference
from trackably.systems.trajectories import Functional, Trajectory


@cache
def is_true(statement: str) -> bool:
    """Whether what the certificate says is true, by a dense search that looks at no box."""
    data = eval(statement)
    certificate = decode_certificate(data)
    reference = as_stored(certificate.reference, data["trajectories"])
    errors = data["evaluation"]["errors"]
    return naive.follows_exactly(reference) and all(
        _margin(reference, certificate, quantity) >= errors[quantity.name] for quantity in reference.quantities
    )


def _margin(reference: Reference, certificate: Certificate, quantity: Quantity) -> Any:
    """Return the smallest distance to a bound, over all times of the claim."""
    if not (pieces := reference.pieces):
        return smallest_margin(reference, certificate.claim, certificate.proof, quantity.name)
    start, end = certificate.claim.span
    if end == float("inf"):
        start, end = 0.0, max(3.0, *(float(z.breakpoints[-1]) for z in pieces))
    low, high = extremes(quantity.functional, pieces, Fraction(start), Fraction(end))
    return min(float(low - quantity.bounds.lower), float(quantity.bounds.upper - high))


def as_stored(reference: Reference, trajectories: dict) -> Reference:
    """With the trajectories of a file, whatever the system's own are."""

    def functionals(parts: list) -> list[Functional]:
        t_s = reference.plant.sampling_time
        return [
            Functional(Fraction(q["offset"]), tuple(tuple(map(Fraction, w)) for w in q["weights"]), t_s) for q in parts
        ]

    states, inputs = functionals(trajectories["states"]), functionals(trajectories["inputs"])
    plant, orders = replace(reference.plant), tuple(len(w) for w in inputs[0].weights)
    for cached in ("given_constraints", "quantities"):  # what follows from the system's own trajectories
        vars(plant).pop(cached, None)
    vars(plant)["flatness"] = Flatness(tuple(map(Trajectory.of, states)), tuple(map(Trajectory.of, inputs)), orders)
    return Reference(reference.signals, plant)


def statement(data: dict) -> str:
    """All that the statement depends on: everything but the boxes."""
    claim = {key: value for key, value in data["claim"].items() if key not in {"covers", "terms"}}
    return repr({**data, "claim": claim})
