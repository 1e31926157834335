"""Certificates read back into the library's own types: the library only writes them, and the checker has its own."""

from fractions import Fraction

import numpy as np

from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate, encode_counterexample
from trackably.certificates.outcome import Counterexample
from trackably.checker.certificate import KINDS, Boxes, Claim, Cover, Instants, Steps, Window
from trackably.codec import decode
from trackably.files import from_json, to_json
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import ConvexHull, DisturbanceSet, Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening


def as_read(found: Certificate | Counterexample) -> dict:
    """What a file says."""
    encode = encode_certificate if isinstance(found, Certificate) else encode_counterexample
    return from_json(to_json(encode(found)))


def decode_certificate(data: dict) -> Certificate:
    """Return the certificate whose `encode_certificate` is `data`; what follows from its reference is not compared."""
    claim, evaluation = data["claim"], data["evaluation"]
    of = claim_of(claim)
    reference = decode(Reference, data["reference"])
    return Certificate(
        reference=reference,
        claim=of,
        proof=_proof(of, claim),
        evaluation_error=dict(evaluation["errors"]),
        evaluated_until=evaluation["until"],
        robust=_robust(data.get("disturbance"), reference.plant.system),
    )


def claim_of(data: dict) -> Claim:
    kind = KINDS[data["kind"]]
    return kind(data["start"], data["end"]) if kind is Window else kind()


def _proof(of: Claim, data: dict) -> Cover | Steps:
    if isinstance(of, Instants):
        return Steps(data["last_step"])
    start, end = of.span if isinstance(of, Window) else (0.0, data.get("tail_start") or data["period"])
    boxes = {name: Boxes(tuple(c["ends"]), tuple(c["radii"])) for name, c in data.get("covers", {}).items()}
    return Cover(start, end, boxes, data.get("terms", 0))


def _robust(data: dict | None, system: LinearSystem) -> Tightening | None:
    if data is None:
        return None
    given = ConstrainedSystem(system, *(decode(Polytope, data[name]) for name in ("state_set", "input_set")))
    V = decode_disturbances(data["noise"]) if "noise" in data else None
    return Tightening(given, 0.0, decode_disturbances(data["set"]), np.array(data["feedback"]), V)


def decode_disturbances(data: dict) -> DisturbanceSet:
    if data["kind"] == "hull":
        return ConvexHull([_fractions(vertex) for vertex in data["vertices"]])
    return Zonotope(_fractions(data["centre"]), [_fractions(generator) for generator in data["generators"]])


def _fractions(texts: list[str]) -> list[Fraction]:
    return [Fraction(text) for text in texts]
