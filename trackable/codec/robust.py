"""What certificates say of disturbed systems, as JSON: rational numbers are texts such as -3/4."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from trackable.certificates.robust import Robust
from trackable.codec.converter import encode
from trackable.systems.disturbance.hull import ConvexHull
from trackable.systems.disturbance.sets import DisturbanceSet


def encode_robust(robust: Robust | None) -> dict[str, Any]:
    """Return the field of a certificate that speaks of disturbances; no field where there are none."""
    if robust is None:
        return {}
    given, Z = robust.given, robust.invariant
    return {
        "disturbance": {
            "state_set": encode(given.state_set),
            "input_set": encode(given.input_set),
            "feedback": Z.feedback.tolist(),
            **_sets(robust),
            "head": Z.head,
            "terms": Z.terms,
            "contraction": Z.contraction,
            "box": Z.box.tolist(),
        }
    }


def _sets(robust: Robust) -> dict[str, Any]:
    if robust.measured is None:
        return {"set": _set(robust.invariant.disturbance)}
    return {"set": _set(robust.measured.disturbance), "noise": _set(robust.measured.noise)}


def _set(disturbance: DisturbanceSet) -> dict[str, Any]:
    if isinstance(disturbance, ConvexHull):
        return {"kind": "hull", "vertices": [_texts(vertex) for vertex in disturbance.vertices]}
    generators = [_texts(generator) for generator in disturbance.generators]
    return {"kind": "zonotope", "centre": _texts(disturbance.centre), "generators": generators}


def _texts(vector: Sequence[Fraction]) -> list[str]:
    return [str(value) for value in vector]
