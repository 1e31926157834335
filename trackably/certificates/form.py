"""Write certificates and counterexamples as JSON objects that the checker reads.

They have a claim, the reference with its system, and the proof. Rational numbers are texts such as -3/4.
"""

import dataclasses
from functools import lru_cache
from typing import Any

from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.checker import certificate as of_certificate
from trackably.checker import counterexample as of_counterexample
from trackably.checker.certificate import KINDS, AllPhases, AllTimes, Claim, Cover, Steps
from trackably.checker.form import subject_of
from trackably.checker.subject import Subject
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import ConvexHull, DisturbanceSet
from trackably.systems.linear import LinearSystem
from trackably.systems.reference import Reference
from trackably.systems.tightening import Tightening


def encode_certificate(certificate: Certificate) -> dict[str, Any]:
    """Return a certificate in the form that the checker reads."""
    return {
        "format": of_certificate.FORMAT,
        "version": of_certificate.VERSION,
        "claim": {**_claim(certificate.claim), **_proof(certificate.claim, certificate.proof)},
        **encode_subject(certificate.reference),
        **_robust(certificate.robust),
        **({"truth": [without_none(as_written(of)) for of in certificate.truth]} if certificate.truth else {}),
        "evaluation": {"until": certificate.evaluated_until, "errors": dict(certificate.evaluation_error)},
    }


def encode_subject(reference: Reference) -> dict[str, Any]:
    """Return the fields about the reference and its system, which certificates and counterexamples share."""
    return {"reference": as_written(reference), **_trajectories(reference.plant), **_attainable(reference.plant)}


@lru_cache(maxsize=8)
def as_subject(reference: Reference) -> Subject:
    """Return the reference, with its system and sets, as the checker reads it.

    The result is cached, because errors, boxes and fingerprint of a reference need it.
    """
    return subject_of(encode_subject(reference))


def encode_counterexample(found: Counterexample) -> dict[str, Any]:
    """Return a counterexample in the form that the checker reads."""
    return {
        "format": of_counterexample.FORMAT,
        "version": of_counterexample.VERSION,
        "claim": _claim(found.claim),
        **encode_subject(found.reference),
        "quantity": found.quantity,
        "at": {"time": found.time} if found.step is None else {"step": found.step},
        "violation": found.violation,
    }


def _claim(claim: Claim) -> dict[str, Any]:
    kind = next(kind for kind, of in KINDS.items() if isinstance(claim, of))
    return {"kind": kind, **dataclasses.asdict(claim)}


def _proof(claim: Claim, proof: Cover | Steps) -> dict[str, Any]:
    if isinstance(proof, Steps):
        return {"last_step": proof.last}
    end = {AllTimes: "tail_start", AllPhases: "period"}.get(type(claim), "end")
    covers = {name: {"ends": list(of.ends), "radii": list(of.radii)} for name, of in proof.boxes.items()}
    return {end: proof.end, **({"covers": covers, "terms": proof.terms} if covers else {})}


def _trajectories(plant: ConstrainedSystem) -> dict[str, Any]:
    """Return states and inputs of a linear system as exact sums of the signals; empty for a nonlinear system."""
    if not isinstance(plant.system, LinearSystem):
        return {}
    sides = {"states": plant.flatness.states, "inputs": plant.flatness.inputs}
    return {
        "trajectories": {
            side: [as_written({"offset": q.offset, "weights": q.weights}) for of in parts if (q := of.functional)]
            for side, parts in sides.items()
        }
    }


def _attainable(plant: ConstrainedSystem) -> dict[str, Any]:
    """Return the field with the bounds of the effect B u of redundant inputs; no field if no inputs are redundant.

    If an input satisfies these bounds, some input in the input set has the same effect.
    """
    if plant.allocation is None:
        return {}
    rows = [limit for limit in plant.quantities if limit.side == "input"]
    found = [{"row": limit.row, "lower": limit.bounds.lower, "upper": limit.bounds.upper} for limit in rows]
    return {"attainable": as_written(found)}


def _robust(tightening: Tightening | None) -> dict[str, Any]:
    """Return the field about disturbances; no field if there are none."""
    if tightening is None or (Z := tightening.invariant) is None:
        return {}
    given, W, V, model = tightening.given, tightening.disturbance, tightening.noise, tightening.model_error
    assert W is not None, "Z is that of disturbances"
    found = {
        "state_set": given.state_set,
        "input_set": given.input_set,
        "feedback": Z.K,
        "set": _set(W),
        "noise": _set(V) if V else None,
        "model": model.vertices if model else None,
        "head": Z.head,
        "terms": Z.terms,
        "contraction": Z.contraction,
        "box": Z.box,
    }
    return {"disturbance": without_none(as_written(found))}


def _set(disturbance: DisturbanceSet) -> dict[str, Any]:
    return {"kind": "hull" if isinstance(disturbance, ConvexHull) else "zonotope", **as_written(disturbance)}


def without_none(written: Any) -> Any:
    """Return the written form without the fields that are None."""
    if not isinstance(written, dict):
        return written
    return {name: without_none(value) for name, value in written.items() if value is not None}


def as_written(value: object) -> Any:
    """Return a value of the library in the form that it has in files."""
    from trackably.codec import encode_unverified  # noqa: PLC0415  loaded with the first proof

    return encode_unverified(value)
