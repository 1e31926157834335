"""Formulas that are written alike, and formulas with other ones in the place of their parts."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from trackably.checker.formulas.formula import (
    Angle,
    Formula,
    Function,
    Name,
    Number,
    Operation,
    Power,
    operands,
    parts,
)


@dataclass(frozen=True)
class Shapes:
    """Numbers of formulas: the same for those that are written alike."""

    known: dict[Formula, int] = field(default_factory=dict)
    numbers: dict[object, int] = field(default_factory=dict)

    def of(self, formula: Formula) -> int:
        """Return the number of a formula."""
        for node in parts(formula):
            if node not in self.known:
                key = (type(node), _own(node), tuple(self.known[part] for part in operands(node)))
                self.known[node] = self.numbers.setdefault(key, len(self.numbers))
        return self.known[formula]

    def shared(self, formulas: Sequence[Formula]) -> list[Formula]:
        """Return the same formulas, in which all parts that are written alike are one object."""
        done: dict[Formula, Formula] = {}
        by_number: dict[int, Formula] = {}
        for formula in formulas:
            self.of(formula)
            for node in parts(formula):
                number = self.known[node]
                done[node] = by_number[number] if number in by_number else remade(node, done)
                by_number[number] = done[node]
        return [done[formula] for formula in formulas]

    def without(self, formulas: Sequence[Formula], hidden: Collection[int]) -> list[Formula]:
        """Return formulas with new names for their largest parts with these numbers, the same for the same number.

        What holds for all values of the new names holds for these parts.
        """
        done: dict[Formula, Formula] = {}
        for formula in formulas:
            self.of(formula)
            for node in parts(formula):  # what is inside of a hidden part is made, and left out with it
                number = self.known[node]
                done[node] = Name(f"#{number}") if number in hidden else remade(node, done)
        return [done[formula] for formula in formulas]


def replaced(formulas: Sequence[Formula], by: Mapping[str, Formula]) -> list[Formula]:
    """Return formulas with formulas in the place of names."""
    done: dict[Formula, Formula] = {}
    for formula in formulas:
        for node in parts(formula):
            done[node] = by.get(node.name, node) if isinstance(node, Name) else remade(node, done)
    return [done[formula] for formula in formulas]


def remade(node: Formula, of: Mapping[Formula, Formula]) -> Formula:
    """Return a node that is made of other parts."""
    match node:
        case Operation(symbol, left, right):
            return Operation(symbol, of[left], of[right])
        case Power(base, exponent):
            return Power(of[base], exponent)
        case Function(function, argument):
            return Function(function, of[argument])
        case Angle(y, x):
            return Angle(of[y], of[x])
    return node


def _own(node: Formula) -> object:
    match node:
        case Number(value):
            return value
        case Name(name):
            return name
        case Operation(symbol):
            return symbol
        case Power(_, exponent):
            return exponent
        case Function(function):
            return function
    return None
