"""Weighted sums in words."""

from collections.abc import Sequence
from fractions import Fraction

_LONGEST = 80


def written(row: Sequence[Fraction], names: Sequence[str]) -> str:
    """x, or x+y, or x-0.5y."""
    signed = []
    for weight, name in zip(map(float, row), names, strict=True):
        if weight:
            size = "" if abs(weight) == 1 else f"{abs(weight):.3g}"
            signed.append(f"{'-' if weight < 0 else '+'}{size}{name}")
    return "".join(signed).removeprefix("+")


def shortened(name: str) -> str:
    """A name that fits into a line."""
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}…"
