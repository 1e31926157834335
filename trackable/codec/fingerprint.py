"""Which reference a certificate is about: the fingerprint that the checker prints, found independently."""

import hashlib
import json
from typing import Any

from trackable.codec.converter import encode
from trackable.systems.reference import Reference


def fingerprint(reference: Reference) -> str:
    """Return SHA-256 of the canonical form of a reference's signals and system, as 64 hexadecimal digits.

    The canonical form is their JSON in UTF-8, with sorted keys and without spaces; −0 is 0, and every number a float.
    """
    data = encode(reference)
    content = _floats({"signals": data["signals"], "system": data["plant"]["system"]})
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def _floats(value: Any) -> Any:
    match value:
        case dict():
            return {key: _floats(inner) for key, inner in value.items()}
        case list():
            return [_floats(inner) for inner in value]
        case bool() | str():
            return value
    return float(value) + 0.0
