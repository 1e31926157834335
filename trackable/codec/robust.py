"""What certificates say of disturbed systems, as JSON: rational numbers are texts such as -3/4."""

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from trackable.certificates.robust import Robust
from trackable.codec.converter import decode, encode
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.disturbance.hull import ConvexHull
from trackable.systems.disturbance.invariant import InvariantSet
from trackable.systems.disturbance.measured import measured
from trackable.systems.disturbance.sets import DisturbanceSet
from trackable.systems.disturbance.zonotope import Zonotope
from trackable.systems.linear import LinearSystem
from trackable.systems.sets.polytope import Polytope


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


def decode_robust(data: Mapping[str, Any] | None, system: object) -> Robust | None:
    """Return what such a field says of a linear system. KeyError, TypeError or ValueError: it says nothing."""
    if data is None:
        return None
    if not isinstance(system, LinearSystem):
        raise ValueError("only linear systems have disturbances")
    given = ConstrainedSystem(system, *(decode(Polytope, data[name]) for name in ("state_set", "input_set")))
    K, W, box = np.array(data["feedback"]), _read_set(data["set"]), np.array(data["box"])
    with_noise = measured(W, _read_set(data["noise"]), len(box)) if "noise" in data else None
    of_errors = with_noise.of_measured_state(system.A) if with_noise else W
    Z = InvariantSet(system, K, of_errors, data["head"], data["terms"], data["contraction"], box)
    return Robust(given, Z, with_noise)


def _sets(robust: Robust) -> dict[str, Any]:
    if robust.measured is None:
        return {"set": _set(robust.invariant.disturbance)}
    return {"set": _set(robust.measured.disturbance), "noise": _set(robust.measured.noise)}


def _set(disturbance: DisturbanceSet) -> dict[str, Any]:
    if isinstance(disturbance, ConvexHull):
        return {"kind": "hull", "vertices": [_texts(vertex) for vertex in disturbance.vertices]}
    generators = [_texts(generator) for generator in disturbance.generators]
    return {"kind": "zonotope", "centre": _texts(disturbance.centre), "generators": generators}


def _read_set(data: Mapping[str, Any]) -> DisturbanceSet:
    if data["kind"] == "hull":
        return ConvexHull([_fractions(vertex) for vertex in data["vertices"]])
    return Zonotope(_fractions(data["centre"]), [_fractions(generator) for generator in data["generators"]])


def _texts(vector: Sequence[Fraction]) -> list[str]:
    return [str(value) for value in vector]


def _fractions(texts: Sequence[str]) -> list[Fraction]:
    return [Fraction(text) for text in texts]
