"""Certificates read back into the library's own types: the library only writes them, and the checker has its own."""

from fractions import Fraction

import numpy as np

from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import AllPhases, AllTimes, AtInstants, OnWindow
from trackably.certificates.cover import Cover
from trackably.certificates.robust import Robust
from trackably.codec import decode
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, Zonotope, with_noise_set
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import InvariantSet

_CLAIMS = {"all_times": AllTimes, "all_phases": AllPhases, "window": OnWindow, "instants": AtInstants}


def decode_certificate(data: dict) -> Certificate:
    """Return the certificate whose `encode_certificate` is `data`; what follows from its reference is not compared."""
    claim, evaluation = dict(data["claim"]), data["evaluation"]
    covers, terms = claim.pop("covers", {}), claim.pop("terms", 0)
    reference = decode(Reference, data["reference"])
    return Certificate(
        reference=reference,
        claim=_CLAIMS[claim.pop("kind")](**claim),
        terms=terms,
        covers={name: Cover(tuple(c["ends"]), tuple(c["radii"])) for name, c in covers.items()},
        evaluation_error=dict(evaluation["errors"]),
        evaluated_until=evaluation["until"],
        robust=_robust(data.get("disturbance"), reference.plant.system),
    )


def _robust(data: dict | None, system: LinearSystem) -> Robust | None:
    if data is None:
        return None
    given = ConstrainedSystem(system, *(decode(Polytope, data[name]) for name in ("state_set", "input_set")))
    K, W, box = np.array(data["feedback"]), _set(data["set"]), np.array(data["box"])
    with_noise = with_noise_set(W, _set(data["noise"]), len(box)) if "noise" in data else None
    of_errors = with_noise.of_measured_state(system.A) if with_noise else W
    Z = InvariantSet(system, K, of_errors, data["head"], data["terms"], data["contraction"], box)
    return Robust(given, Z, with_noise)


def _set(data: dict) -> DisturbanceSet:
    if data["kind"] == "hull":
        return ConvexHull([_fractions(vertex) for vertex in data["vertices"]])
    return Zonotope(_fractions(data["centre"]), [_fractions(generator) for generator in data["generators"]])


def _fractions(texts: list[str]) -> list[Fraction]:
    return [Fraction(text) for text in texts]
