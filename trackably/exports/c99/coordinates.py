"""States and inputs in C: weighted sums of signals at shifted times, and formulas of such sums."""

from collections.abc import Callable, Iterable

from trackably.exports.c99.numerals import number
from trackably.systems.flat.functional import Functional
from trackably.systems.flat.trajectory import Coordinate
from trackably.systems.formulas.expression import (
    Angle,
    Binary,
    Constant,
    Expression,
    Function,
    Power,
    Variable,
)

_FUNCTIONS = frozenset({"exp", "log", "sqrt", "sin", "cos", "atan"})
"""Those that the C library has under the same name."""


def assigned(coordinate: Coordinate, target: str, written: Callable[[Functional], str]) -> list[str]:
    """Return the lines that put a coordinate's value into `target`; functionals are `written` as expressions.

    ValueError: a function that has no counterpart in C.
    """
    if isinstance(coordinate, Functional):
        return [f"{target} = {written(coordinate)};"]
    lines, names = ["{"], {name: f"a{i}" for i, (name, _) in enumerate(coordinate.arguments)}
    lines += [f"    const double {names[name]} = {written(functional)};" for name, functional in coordinate.arguments]
    steps = coordinate.formula.steps
    lines += [
        f"    const double v{i} = {_computed(node, [f'v{place}' for place in places], names)};"
        for i, (node, places) in enumerate(steps)
    ]
    return [*lines, f"    {target} = v{len(steps) - 1};", "}"]


def counts(coordinates: Iterable[Coordinate], signals: int) -> list[int]:
    """Return for each signal c how many z_c[j] coordinates need: one at least."""
    needed = [1] * signals
    for coordinate in coordinates:
        parts = [coordinate] if isinstance(coordinate, Functional) else [part for _, part in coordinate.arguments]
        for c, weights in (pair for part in parts for pair in part.rounded):
            needed[c] = max(needed[c], 1 + int(weights.nonzero()[0][-1]))
    return needed


def plain_sum(functional: Functional) -> str:
    """Return offset + Σ_c Σ_j w_cj z_c[j], with z_c[j] = signal c at t + j T_s, without weights that are zero."""
    found = number(float(functional.offset))
    for c, weights in functional.rounded:
        terms = " + ".join(f"{number(w)} * z{c}[{j}]" for j, w in enumerate(weights.tolist()) if w)
        found = f"{found} + ({terms})"
    return found


def _computed(node: Expression, operands: list[str], names: dict[str, str]) -> str:
    match node:
        case Constant(value):
            return number(value)
        case Variable(name):
            return names[name]
        case Binary():
            return f"{operands[0]} {node.symbol} {operands[1]}"
        case Power(_, exponent):
            return f"pow({operands[0]}, {number(exponent)})"
        case Function(name, _) if name in _FUNCTIONS:
            return f"{name}({operands[0]})"
        case Angle():
            return f"atan2({operands[0]}, {operands[1]})"
    raise ValueError(f"to_c: there is no counterpart in C of {node}")
