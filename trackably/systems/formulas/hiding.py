"""Put variables in the place of parts of formulas: what holds whatever their values are holds for these parts too."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from trackably.systems.formulas.expression import (
    Constant,
    Expression,
    Function,
    Power,
    Variable,
    all_nodes,
    operands,
)
from trackably.systems.formulas.substitution import rebuilt


@dataclass(frozen=True)
class Shapes:
    """Numbers of formulas: equal for those that are written alike."""

    _known: dict[int, tuple[Expression, int]] = field(default_factory=dict)
    _numbers: dict[object, int] = field(default_factory=dict)
    _shared: dict[int, Expression] = field(default_factory=dict)

    def of(self, expression: Expression) -> int:
        """Return the number of a formula."""
        for node in all_nodes(expression):
            if id(node) not in self._known:  # the node is kept, so that no other one gets its id
                inner = tuple(self._known[id(operand)][1] for operand in operands(node))
                key = (type(node), _own(node), inner)
                self._known[id(node)] = node, self._numbers.setdefault(key, len(self._numbers))
        return self._known[id(expression)][1]

    def shared(self, expression: Expression) -> Expression:
        """Return the formula with one object for all parts that are written alike, in all formulas given so far."""
        self.of(expression)
        for node in all_nodes(expression):
            number = self._known[id(node)][1]
            if number not in self._shared:
                inner = [self._shared[self._known[id(operand)][1]] for operand in operands(node)]
                self._shared[number] = rebuilt(node, inner)
        return self._shared[self._known[id(expression)][1]]

    def without(self, expression: Expression, hidden: Collection[int]) -> Expression:
        """Return the formula with variables for the largest parts whose numbers are `hidden`."""
        self.of(expression)
        done: dict[int, Expression] = {}
        return self._without(expression, hidden, done)

    def _without(self, node: Expression, hidden: Collection[int], done: dict[int, Expression]) -> Expression:
        if id(node) not in done:
            number = self._known[id(node)][1]
            if number in hidden:
                done[id(node)] = Variable(f"#{number}")
            else:
                inner = [self._without(operand, hidden, done) for operand in operands(node)]
                done[id(node)] = rebuilt(node, inner)
        return done[id(node)]


def _own(node: Expression) -> object:
    match node:
        case Constant(value):
            return value
        case Variable(name) | Function(name, _):
            return name
        case Power(_, exponent):
            return exponent
    return None


def hideable(formulas: Sequence[Expression], shapes: Shapes) -> set[int]:
    """Return the numbers of formulas that are no variables or numbers themselves."""
    return {shapes.of(formula) for formula in formulas if not isinstance(formula, Variable | Constant)}
