"""Split formulas that are affine in the inputs into drift and gains, and solve them for the inputs, by fixed rules.

The checker derives the same formulas independently, so the rules are stated exactly (a zero part is None; a factor 1 is
left out; nothing else is simplified):

- a formula without inputs is drift; an input alone has the gain 1;
- sums and differences are split term by term; −b alone is −1 · b;
- in a product, or a quotient with inputs only in the numerator, each part is multiplied or divided.

x⁺ = f0 + G u is then solved for u; gains equal to the number 0 count as zero. While an equation has only one unknown
input, the first such equation gives that input, (x⁺ − f0 − Σ known G u)/G. The rest is solved by Cramer's rule, inputs
in their order. Determinants are expanded along their first row, Cramer's numerators along the replaced column.

So every part of f occurs in the formula of some input: f is defined, and has one solution u, exactly where all these
formulas are defined.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from trackably.systems.formulas.algebra import Term, minus, over, plus, times
from trackably.systems.formulas.expression import (
    ONE,
    Constant,
    Difference,
    Expression,
    Product,
    Quotient,
    Sum,
    Variable,
    all_nodes,
    operands,
)

MAX_COUPLED = 3
"""How many inputs may occur together in equations that Cramer's rule solves."""

_ZERO = Constant(0.0)


@dataclass(frozen=True)
class Affine:
    """`drift` + Σ_j `gains`[j] u_j, where j is the name of an input."""

    drift: Term
    gains: Mapping[str, Expression]


def affine_parts(expression: Expression, inputs: frozenset[str]) -> Affine:
    """Split an expression into drift and gains. ValueError: it is not affine in the inputs; names the wrong part."""
    known: dict[int, Affine] = {}
    for node in all_nodes(expression):
        known[id(node)] = _parts_of(node, inputs, lambda operand: known[id(operand)])
    return known[id(expression)]


def _parts_of(node: Expression, inputs: frozenset[str], of: Callable[[Expression], Affine]) -> Affine:
    if isinstance(node, Variable) and node.name in inputs:
        return Affine(None, {node.name: ONE})
    held = [bool(of(operand).gains) for operand in operands(node)]  # whether each operand contains an input
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


def _merged(a: Affine, b: Affine, combine: Callable[[Term, Term], Term]) -> Affine:
    gains = {name: combine(a.gains.get(name), b.gains.get(name)) for name in {**a.gains, **b.gains}}
    return Affine(combine(a.drift, b.drift), {name: gain for name, gain in gains.items() if gain is not None})


def _each(a: Affine, change: Callable[[Term], Term]) -> Affine:
    gains = {name: change(gain) for name, gain in a.gains.items()}
    return Affine(change(a.drift), {name: gain for name, gain in gains.items() if gain is not None})


@dataclass(frozen=True)
class InputFormulas:
    """The formula of each input, and the `pivots` that these formulas divide by."""

    inputs: Mapping[str, Expression]
    pivots: tuple[Expression, ...]


def solve_for_inputs(
    equations: Sequence[Affine], successors: Sequence[Expression], inputs: Sequence[str]
) -> InputFormulas:
    """Solve successors[i] = equations[i] for the `inputs`, as many as equations.

    ValueError: G is singular for all states, or more than `MAX_COUPLED` inputs are coupled.
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
        found[name] = _nonzero(over(rests[i], gain), name)
        pivots.append(gain)
        for other in open_rows:
            known = rows[other].pop(name, None)
            rests[other] = minus(rests[other], times(known, found[name]))
    names = [name for name in inputs if name not in found]
    if len(open_rows) > MAX_COUPLED:
        raise ValueError(
            f"system: at most {MAX_COUPLED} inputs may be coupled with each other, but {', '.join(names)} are"
        )
    matrix = [[rows[i].get(name) for name in names] for i in open_rows]
    if open_rows:
        determinant = _nonzero(_determinant(matrix) if len(names) == len(open_rows) else None, ", ".join(names))
        pivots.append(determinant)
        for j, name in enumerate(names):
            found[name] = _nonzero(over(_numerator(matrix, [rests[i] for i in open_rows], j), determinant), name)
    return InputFormulas(found, tuple(pivots))


def _numerator(matrix: list[list[Term]], rests: list[Term], j: int) -> Term:
    total: Term = None
    for i, rest in enumerate(rests):
        minor = _determinant([row[:j] + row[j + 1 :] for k, row in enumerate(matrix) if k != i])
        total = (minus if (i + j) % 2 else plus)(total, times(minor, rest))
    return total


def _determinant(matrix: list[list[Term]]) -> Term:
    """Return the determinant, expanded along the first row."""
    if not matrix:
        return ONE
    total: Term = None
    for j, entry in enumerate(matrix[0]):
        minor = _determinant([row[:j] + row[j + 1 :] for row in matrix[1:]])
        total = (minus if j % 2 else plus)(total, times(entry, minor))
    return total


def _nonzero(part: Term, name: str) -> Expression:
    if part is None:
        raise ValueError(
            f"system: f must be solvable for its inputs, but whatever the states are it cannot be solved for {name}: "
            "G(x) in x⁺ = f0(x) + G(x) u is singular"
        )
    return part
