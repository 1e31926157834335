"""Weighted sums as text, for names and messages."""

from collections.abc import Sequence
from fractions import Fraction

_LONGEST = 80


def weighted_sum_text(row: Sequence[Fraction], names: Sequence[str], digits: int = 3) -> str:
    """Format Σ_i row_i name_i, as x, x+y or x-0.5y; weights with so many `digits`."""
    signed = []
    for weight, name in zip(map(float, row), names, strict=True):
        if weight:
            size = "" if abs(weight) == 1 else f"{abs(weight):.{digits}g}"
            signed.append(f"{'-' if weight < 0 else '+'}{size}{name}")
    return "".join(signed).removeprefix("+")


def shortened(name: str) -> str:
    """Shorten a name to fit into a line."""
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}…"
