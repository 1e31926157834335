"""Find flat forms: of chains, of blocks that hang together in a triangle, and of products of such.

As many states as there are inputs are taken for flat outputs. While an equation x_i⁺ = f_i of a known x_i holds one
unknown, f_i = a + b v, or a + b √v, it gives v: (x_i⁺ − a)/b, or the square of it, which is then claimed to be the
square of something positive. Where none does, two or three equations that are affine in as many unknowns give these
together, by Cramer's rule. If in the end all states and inputs are known, these are a flat form.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import comb

from trackably.systems.flat.form import MOST_PARTS, MOST_SHIFTS, FlatForm, indices, named, one_step_later
from trackably.systems.formulas.affine import MAX_COUPLED, affine_parts, solve_for_inputs
from trackably.systems.formulas.algebra import minus, over
from trackably.systems.formulas.expression import (
    Expression,
    Function,
    Power,
    Variable,
    all_nodes,
    size_and_depth,
    variables,
)
from trackably.systems.formulas.substitution import substituted

_MOST_CHOICES = 2000
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
        ready = [i for i in open_equations if states[i] in known]
        i = next((i for i in ready if len(_unknown(f[i], every, known)) == 1), None)
        if i is None:
            block = _solved_together(f, states, ready, every, known)
            if block is None:
                return None
            rows, solved = block
            open_equations = [j for j in open_equations if j not in rows]
            known |= solved
            continue
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
    if _is_far_ahead(known[state]):
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
    if found is None or size_and_depth(found)[0] > MOST_PARTS:
        return None
    return (Power(found, 2.0), found) if under_root else (found, None)


def _solved_together(
    f: Sequence[Expression], states: Sequence[str], ready: Sequence[int], every: set[str], known: dict[str, Expression]
) -> tuple[tuple[int, ...], Mapping[str, Expression]] | None:
    """Return equations, as few as possible, that determine as many unknowns, and these; None if there are none."""
    for count in range(2, MAX_COUPLED + 1):
        for rows in combinations([i for i in ready if not _is_far_ahead(known[states[i]])], count):
            names = sorted(set().union(*(_unknown(f[i], every, known) for i in rows)))
            if len(names) != count:
                continue
            try:
                parts = [affine_parts(substituted(f[i], known), frozenset(names)) for i in rows]
                found = solve_for_inputs(parts, [one_step_later(known[states[i]]) for i in rows], names).inputs
            except ValueError:
                continue
            if all(size_and_depth(formula)[0] <= MOST_PARTS for formula in found.values()):
                return rows, found
    return None


def _is_far_ahead(formula: Expression) -> bool:
    return max(indices(z)[1] for z in variables(formula)) >= MOST_SHIFTS - 1


def _with_root_named(formula: Expression, root: Expression) -> Expression:
    """Return the formula with a variable in the place of a root."""
    return substituted(formula, {}, {root: Variable(_ROOT)})
