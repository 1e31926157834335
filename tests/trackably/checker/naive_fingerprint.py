"""The fingerprint that the checker prints, written a second time from what the theorem says of it."""

import hashlib
import json
from fractions import Fraction
from typing import Any

from trackably.certificates.form import encode_subject
from trackably.systems.reference import Reference


def fingerprint(reference: Reference) -> str:
    """Return SHA-256 of the canonical form of what defines x(t) and u(t), as 64 hexadecimal digits.

    It is the JSON of signals, system, and a linear system's trajectories in UTF-8, with sorted keys and without spaces;
    −0 is 0, and every number a float. Rational numbers are hexadecimal texts such as -3/a, and zeros after the last
    other weight of a signal are left out.
    """
    data = encode_subject(reference)
    content = _floats({"signals": data["reference"]["signals"], "system": data["reference"]["plant"]["system"]})
    if "trajectories" in data:
        content["trajectories"] = {side: list(map(_exact, parts)) for side, parts in data["trajectories"].items()}
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def _exact(functional: dict[str, Any]) -> dict[str, Any]:
    weights = [list(map(_hex, of_signal)) for of_signal in functional["weights"]]
    for of_signal in weights:
        while of_signal and of_signal[-1] == "0/1":
            of_signal.pop()
    return {"offset": _hex(functional["offset"]), "weights": weights}


def _hex(number: str) -> str:
    p, q = Fraction(number).as_integer_ratio()
    return f"{p:x}/{q:x}"


def _floats(value: Any) -> Any:
    match value:
        case dict():
            return {key: _floats(inner) for key, inner in value.items()}
        case list():
            return [_floats(inner) for inner in value]
        case bool() | str():
            return value
    return float(value) + 0.0
