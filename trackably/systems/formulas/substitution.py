"""Put formulas in the place of variables."""

from collections.abc import Mapping

from trackably.systems.formulas.expression import (
    Angle,
    Binary,
    Expression,
    Function,
    Power,
    Variable,
    all_nodes,
    operands,
)


def substituted(
    expression: Expression, formulas: Mapping[str, Expression], parts: Mapping[Expression, Expression] | None = None
) -> Expression:
    """Return the expression with these formulas in the place of the variables that they are named after.

    What is in `parts` is replaced first, wherever it is.
    """
    known: dict[int, Expression] = {}
    for node in all_nodes(expression):
        inner = [known[id(operand)] for operand in operands(node)]
        known[id(node)] = parts[node] if parts and node in parts else _rebuilt(node, inner, formulas)
    return known[id(expression)]


def _rebuilt(node: Expression, inner: list[Expression], formulas: Mapping[str, Expression]) -> Expression:
    return formulas.get(node.name, node) if isinstance(node, Variable) else rebuilt(node, inner)


def rebuilt(node: Expression, inner: list[Expression]) -> Expression:
    """Return a node with other operands."""
    match node:
        case Binary():
            return type(node)(*inner)
        case Power(_, exponent):
            return Power(inner[0], exponent)
        case Function(name, _):
            return Function(name, inner[0])
        case Angle():
            return Angle(*inner)
    return node
