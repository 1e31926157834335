"""Find flat forms: of chains, of blocks that hang together in a triangle, and of products of such.

As many states as there are inputs are taken for flat outputs. While an equation x_i⁺ = f_i of a known x_i holds one
unknown, f_i = a + b v, or a + b √v, it gives v: (x_i⁺ − a)/b, or the square of it, which is then claimed to be the
square of something positive. If in the end all states and inputs are known, these are a flat form.
"""

from collections.abc import Sequence
from itertools import combinations
from math import comb

from trackable.systems.flat.form import MOST_SHIFTS, FlatForm, indices, named, one_step_later
from trackable.systems.formulas.affine import affine_parts
from trackable.systems.formulas.algebra import minus, over
from trackable.systems.formulas.expression import (
    Expression,
    Function,
    Power,
    Variable,
    all_nodes,
    size_and_depth,
    variables,
)
from trackable.systems.formulas.substitution import substituted

_MOST_CHOICES, _MOST_SIZE = 2000, 1000
_ROOT = "√"


def found_form(f: Sequence[Expression], states: Sequence[str], inputs: Sequence[str]) -> FlatForm | None:
    """Return the flat form whose flat outputs are the first states for which there is one; None if none is found."""
    if not inputs or comb(len(states), len(inputs)) > _MOST_CHOICES:
        return None
    choices = combinations(range(len(states)), len(inputs))
    return next((form for choice in choices if (form := _form(f, states, inputs, choice)) is not None), None)


def _form(
    f: Sequence[Expression], states: Sequence[str], inputs: Sequence[str], choice: tuple[int, ...]
) -> FlatForm | None:
    known: dict[str, Expression] = {states[i]: Variable(named(c, 0)) for c, i in enumerate(choice)}
    positive: list[Expression] = []
    open_equations, every = list(range(len(f))), {*states, *inputs}
    while open_equations:
        ready = (i for i in open_equations if states[i] in known and len(_unknown(f[i], every, known)) == 1)
        i = next(ready, None)
        if i is None:
            return None
        (name,) = _unknown(f[i], every, known)
        found = _solved(f[i], states[i], name, known)
        if found is None:
            return None
        open_equations.remove(i)
        known[name], root = found
        positive += [root] if root is not None else []
    if known.keys() != every:
        return None
    return FlatForm(
        tuple(known[name] for name in states), tuple(known[name] for name in inputs), positive=tuple(positive)
    )


def _unknown(formula: Expression, every: set[str], known: dict[str, Expression]) -> set[str]:
    return {name for name in variables(formula) if name in every and name not in known}


def _solved(
    formula: Expression, state: str, name: str, known: dict[str, Expression]
) -> tuple[Expression, Expression | None] | None:
    """Return the unknown of an equation, and the positive root of which it is the square; None if it is no such one."""
    if max(indices(z)[1] for z in variables(known[state])) >= MOST_SHIFTS - 1:
        return None
    root = Function("sqrt", Variable(name))
    under_root = any(node == root for node in all_nodes(formula))
    formula = _with_root_named(formula, root) if under_root else formula
    wanted = _ROOT if under_root else name
    if under_root and name in variables(formula):
        return None
    try:
        parts = affine_parts(formula, frozenset([wanted]))
    except ValueError:
        return None
    if wanted not in parts.gains:
        return None
    drift = None if parts.drift is None else substituted(parts.drift, known)
    found = over(minus(one_step_later(known[state]), drift), substituted(parts.gains[wanted], known))
    if found is None or size_and_depth(found)[0] > _MOST_SIZE:
        return None
    return (Power(found, 2.0), found) if under_root else (found, None)


def _with_root_named(formula: Expression, root: Expression) -> Expression:
    """Return the formula with a variable in the place of a root."""
    return substituted(formula, {}, {root: Variable(_ROOT)})
