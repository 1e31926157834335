"""Numbers in C: hexadecimal, so that every compiler reads the same float64."""

from collections.abc import Iterable

_A_LINE = 4


def number(value: float) -> str:
    """Return a float64 as a literal, exactly; in brackets if negative."""
    text = float(value).hex()
    return f"({text})" if text.startswith("-") else text


def array(name: str, values: Iterable[float]) -> list[str]:
    """Return the lines that define a constant array of doubles."""
    literals = [float(value).hex() for value in values]
    rows = [", ".join(literals[i : i + _A_LINE]) for i in range(0, len(literals), _A_LINE)]
    return [f"static const double {name}[{len(literals)}] = {{", *(f"    {row}," for row in rows), "};"]
