"""A fingerprint of a reference: of all that defines x(t) and u(t), whatever sets and claims a file has beside it."""

import hashlib
from fractions import Fraction

from trackably.checker.subject import Functional, Trajectories


def fingerprint(signals: object, system: object, trajectories: Trajectories | None) -> str:
    """Return SHA-256 of the canonical form of signals, system and trajectories, as 64 hexadecimal digits.

    The canonical form is the JSON of {"signals", "system", "trajectories"} in UTF-8, with sorted keys, without spaces,
    and with every number as the shortest decimal that float64 reads as it (Python's `repr`), where −0 is 0. Rational
    numbers are texts in lowest terms and hexadecimal digits, as in "-3/a", and zeros after the last other weight of a
    signal are left out. Nonlinear systems have no "trajectories".
    """
    content = {"signals": signals, "system": system}
    if trajectories:
        content["trajectories"] = {"states": _exact(trajectories.states), "inputs": _exact(trajectories.inputs)}
    return hashlib.sha256(_canonical(content).encode()).hexdigest()


def _exact(parts: tuple[Functional, ...]) -> list[object]:
    return [{"offset": _hex(part.offset), "weights": [*map(_without_last_zeros, part.weights)]} for part in parts]


def _without_last_zeros(weights: tuple[Fraction, ...]) -> list[str]:
    used = max((j + 1 for j, w in enumerate(weights) if w), default=0)
    return [*map(_hex, weights[:used])]


def _hex(number: Fraction) -> str:
    return f"{number.numerator:x}/{number.denominator:x}"


def _canonical(value: object) -> str:
    """Return the canonical form of what was read: the texts in it are names and numbers, which need no escapes."""
    if isinstance(value, dict):
        return f"{{{','.join(f'{_canonical(key)}:{_canonical(value[key])}' for key in sorted(value))}}}"
    if isinstance(value, list):
        return f"[{','.join(map(_canonical, value))}]"
    return repr(float(value) + 0.0) if isinstance(value, int | float) else f'"{value}"'
