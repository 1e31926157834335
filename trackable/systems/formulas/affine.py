"""Formulas that are affine in the inputs, taken apart and solved for the inputs by rules that anyone can follow.

The rules (a part that is not there is None; a factor 1 is left out; nothing else is simplified):

- what holds no input is all drift; an input has the gain 1;
- sums and differences are taken apart term by term, −b being −1 · b where nothing is before it;
- a product or quotient with an input in one factor (never in the denominator) multiplies or divides each of its parts.

x⁺ = f0 + G u is then solved for u, gains that are the number 0 not being there. As long as an equation holds one
unknown input only, the first such equation gives that input, (x⁺ − f0 − Σ known G u)/G; what remains is solved by
Cramer's rule, inputs in their order. Determinants are expanded along their first row, and Cramer's numerators along the
column in question.

So every part of f is in some input's formula, and f is defined, and solved by one u only, where all of these are.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from trackable.systems.formulas.algebra import Maybe, minus, over, plus, times
from trackable.systems.formulas.expression import (
    ONE,
    Constant,
    Difference,
    Expression,
    Product,
    Quotient,
    Sum,
    Variable,
    operands,
    parts,
)

MOST_COUPLED = 3
_ZERO = Constant(0.0)


@dataclass(frozen=True)
class Affine:
    """`drift` + Σ_j `gains`[j] u_j, j being the name of an input."""

    drift: Maybe
    gains: Mapping[str, Expression]


def split(expression: Expression, inputs: frozenset[str]) -> Affine:
    """The parts of an expression. ValueError where it is not affine in the inputs, with the part that is to blame."""
    known: dict[int, Affine] = {}
    for node in parts(expression):
        known[id(node)] = _split(node, inputs, lambda operand: known[id(operand)])
    return known[id(expression)]


def _split(node: Expression, inputs: frozenset[str], of: Callable[[Expression], Affine]) -> Affine:
    if isinstance(node, Variable) and node.name in inputs:
        return Affine(None, {node.name: ONE})
    held = [bool(of(operand).gains) for operand in operands(node)]  # whether there is an input in it
    if not any(held):
        return Affine(node, {})
    match node:
        case Sum(a, b):
            found = _merged(of(a), of(b), plus)
        case Difference(a, b):
            found = _merged(of(a), of(b), minus)
        case Product(a, b) if not held[1]:
            found = _each(of(a), lambda part: times(part, b))
        case Product(a, b) if not held[0]:
            found = _each(of(b), lambda part: times(a, part))
        case Quotient(a, b) if not held[1]:
            found = _each(of(a), lambda part: over(part, b))
        case _:
            raise ValueError(
                f"system: f must be affine in its inputs, x⁺ = f0(x) + G(x) u, so that it can be solved for them, but "
                f"holds {node}"
            )
    return found


def _merged(a: Affine, b: Affine, combine: Callable[[Maybe, Maybe], Maybe]) -> Affine:
    gains = {name: combine(a.gains.get(name), b.gains.get(name)) for name in {**a.gains, **b.gains}}
    return Affine(combine(a.drift, b.drift), {name: gain for name, gain in gains.items() if gain is not None})


def _each(a: Affine, change: Callable[[Maybe], Maybe]) -> Affine:
    gains = {name: change(gain) for name, gain in a.gains.items()}
    return Affine(change(a.drift), {name: gain for name, gain in gains.items() if gain is not None})


@dataclass(frozen=True)
class Solved:
    """The formula of each input, and what they divide by."""

    inputs: Mapping[str, Expression]
    pivots: tuple[Expression, ...]


def solved(equations: Sequence[Affine], successors: Sequence[Expression], inputs: Sequence[str]) -> Solved:
    """u of successors[i] = equations[i], for as many `inputs` as equations.

    Raises ValueError where they cannot be solved whatever the states are, and where more than `MOST_COUPLED` inputs
    occur together in all of the equations that are left.
    """
    rows = [{name: gain for name, gain in equation.gains.items() if gain != _ZERO} for equation in equations]
    rests = [minus(successor, equation.drift) for successor, equation in zip(successors, equations, strict=True)]
    found: dict[str, Expression] = {}
    pivots: list[Expression] = []
    open_rows = list(range(len(rows)))
    while single := [i for i in open_rows if len(rows[i]) == 1]:
        i = single[0]
        open_rows.remove(i)
        ((name, gain),) = rows[i].items()
        found[name] = _there(over(rests[i], gain), name)
        pivots.append(gain)
        for other in open_rows:
            known = rows[other].pop(name, None)
            rests[other] = minus(rests[other], times(known, found[name]))
    names = [name for name in inputs if name not in found]
    if len(open_rows) > MOST_COUPLED:
        raise ValueError(
            f"system: at most {MOST_COUPLED} inputs may be coupled with each other, but {', '.join(names)} are"
        )
    matrix = [[rows[i].get(name) for name in names] for i in open_rows]
    if open_rows:
        determinant = _there(_determinant(matrix) if len(names) == len(open_rows) else None, ", ".join(names))
        pivots.append(determinant)
        for j, name in enumerate(names):
            found[name] = _there(over(_numerator(matrix, [rests[i] for i in open_rows], j), determinant), name)
    return Solved(found, tuple(pivots))


def _numerator(matrix: list[list[Maybe]], rests: list[Maybe], j: int) -> Maybe:
    total: Maybe = None
    for i, rest in enumerate(rests):
        minor = _determinant([row[:j] + row[j + 1 :] for k, row in enumerate(matrix) if k != i])
        total = (minus if (i + j) % 2 else plus)(total, times(minor, rest))
    return total


def _determinant(matrix: list[list[Maybe]]) -> Maybe:
    """Expanded along the first row."""
    if not matrix:
        return ONE
    total: Maybe = None
    for j, entry in enumerate(matrix[0]):
        minor = _determinant([row[:j] + row[j + 1 :] for row in matrix[1:]])
        total = (minus if j % 2 else plus)(total, times(entry, minor))
    return total


def _there(part: Maybe, name: str) -> Expression:
    if part is None:
        raise ValueError(
            f"system: f must be solvable for its inputs, but whatever the states are it cannot be solved for {name}: "
            "G(x) in x⁺ = f0(x) + G(x) u is singular"
        )
    return part
