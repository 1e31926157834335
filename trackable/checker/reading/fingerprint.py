"""A fingerprint of a reference: that of its signals and its system, whatever sets and claims a file has beside them."""

import hashlib


def fingerprint(signals: object, system: object) -> str:
    """Return SHA-256 of the canonical form of signals and system, as 64 hexadecimal digits.

    The canonical form is the JSON of {"signals", "system"} in UTF-8, with sorted keys, without spaces, and with every
    number as the shortest decimal that float64 reads as it (Python's `repr`), where −0 is 0.
    """
    return hashlib.sha256(_canonical({"signals": signals, "system": system}).encode()).hexdigest()


def _canonical(value: object) -> str:
    """Return the canonical form of what was read: the texts in it are names, which need no escapes."""
    if isinstance(value, dict):
        return f"{{{','.join(f'{_canonical(key)}:{_canonical(value[key])}' for key in sorted(value))}}}"
    if isinstance(value, list):
        return f"[{','.join(map(_canonical, value))}]"
    return repr(float(value) + 0.0) if isinstance(value, int | float) else f'"{value}"'
