"""Certificates as JSON: a claim, the reference it is about in the form of the codec, and what verifies the claim."""

import dataclasses
from typing import Any

from trackable.certificates.certificate import Certificate
from trackable.certificates.claim import AllPhases, AllTimes, AtInstants, Claim, OnWindow
from trackable.codec.converter import encode
from trackable.codec.robust import encode_robust
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.flat.functional import Functional
from trackable.systems.linear import LinearSystem
from trackable.systems.reference import Reference

FORMAT = "trackable certificate"
VERSION = 3

_CLAIMS: dict[str, type[AllTimes | AllPhases | OnWindow | AtInstants]] = {
    "all_times": AllTimes,
    "all_phases": AllPhases,
    "window": OnWindow,
    "instants": AtInstants,
}


def encode_certificate(certificate: Certificate) -> dict[str, Any]:
    """Return a certificate as nested dicts, lists, strings and numbers: the input of the checker."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "claim": {**_claim(certificate.claim), **_proof(certificate)},
        **encode_subject(certificate.reference),
        **encode_robust(certificate.robust),
        "evaluation": {"until": certificate.evaluated_until, "errors": dict(certificate.evaluation_error)},
    }


def encode_subject(reference: Reference) -> dict[str, Any]:
    """Return what certificates and counterexamples are about."""
    return {"reference": encode(reference), **_trajectories(reference.plant), **_attainable(reference.plant)}


def _claim(claim: Claim) -> dict[str, Any]:
    kind = next(kind for kind, cls in _CLAIMS.items() if isinstance(claim, cls))
    return {"kind": kind, **dataclasses.asdict(claim)}


def _proof(certificate: Certificate) -> dict[str, Any]:
    covers = {
        name: {"ends": list(cover.ends), "radii": list(cover.radii)} for name, cover in certificate.covers.items()
    }
    return {"covers": covers, "terms": certificate.terms} if covers else {}


def _trajectories(plant: ConstrainedSystem) -> dict[str, Any]:
    """Return states and inputs of a linear system as exact sums of the signals; a nonlinear system's follow from f."""
    if not isinstance(plant.system, LinearSystem):
        return {}
    sides = (("states", plant.flatness.states), ("inputs", plant.flatness.inputs))
    exact = {side: [_functional(q) for q in parts if isinstance(q, Functional)] for side, parts in sides}
    return {"trajectories": exact}


def _functional(functional: Functional) -> dict[str, Any]:
    """Return the rational numbers of a functional, written as "p/q"."""
    weights = [[str(w) for w in of_signal] for of_signal in functional.weights]
    return {"offset": str(functional.offset), "weights": weights}


def _attainable(plant: ConstrainedSystem) -> dict[str, Any]:
    """Return bounds of redundant inputs: where they are kept, some input in the input set acts alike."""
    if plant.allocation is None:
        return {}
    rows = [limit for limit in plant.constraints if limit.side == "input"]
    return {
        "attainable": [
            {"row": [str(r) for r in limit.row], "lower": limit.bounds.lower, "upper": limit.bounds.upper}
            for limit in rows
        ]
    }
