"""Flat forms of nonlinear systems: states and inputs as formulas of flat outputs at this step and at later ones."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import comb, pi, tan
from typing import Any, Self

import numpy as np

from trackably.systems.expressions import (
    ONE,
    Angle,
    Constant,
    Difference,
    Expression,
    Function,
    Power,
    Product,
    Quotient,
    Shapes,
    Sum,
    Term,
    Variable,
    all_nodes,
    minus,
    operands,
    over,
    plus,
    rebuilt,
    size_and_depth,
    substituted,
    times,
    variables,
)
from trackably.systems.polytopes import Interval
from trackably.systems.tracing import Symbol, formulas_of

MOST_SHIFTS = 12
MOST_PARTS = 30_000
"""How many operations, names and numbers a formula may have when it is written out, where shared parts count often."""
_SHIFTED = re.compile(r"z([1-9][0-9]?)\[([0-9]|1[0-2])\]")


@dataclass(frozen=True)
class FlatForm:
    """x(k) = X(z(k), z(k + 1), …) and u(k) = U(z(k), z(k + 1), …), where z_c(k + j) is the variable z{c}[{j}].

    States named in `angles` matter up to whole turns: X may jump by 2π where it takes the angle of a vector. Formulas
    in `positive` are positive wherever a reference is proved, which the proof shows; √(p²) is p for such a formula p.
    """

    states: tuple[Expression, ...]
    inputs: tuple[Expression, ...]
    angles: tuple[str, ...] = ()
    positive: tuple[Expression, ...] = ()

    def __post_init__(self) -> None:
        for formula in (*self.states, *self.inputs, *self.positive):
            for name in variables(formula):
                _ = indices(name)
        self._share_parts()
        if missing := {*range(self.outputs)} - {c for c, _ in self._shifted}:
            raise ValueError(f"flat form: no state and no input depends on z{min(missing) + 1}")

    def _share_parts(self) -> None:
        """Make one object of parts that are written alike, so that each is evaluated once."""
        shapes = Shapes()
        for name in ("states", "inputs", "positive"):
            object.__setattr__(self, name, tuple(shapes.shared(formula) for formula in getattr(self, name)))

    @classmethod
    def of(cls, function: Callable[[Any], Any], outputs: int, angles: Sequence[str] = ()) -> Self:
        """Return the flat form of a function of z that returns a list of states and one of inputs.

        z[j] is the array of the flat outputs at step k + j. The function is called with symbols: it must use
        ordinary arithmetic only (see `formulas.symbol`). ValueError: it is no such function; says why.
        """
        states, inputs = formulas_of(lambda: function(_Shifts(outputs)), "flat form")
        return cls(states, inputs, tuple(angles))

    @property
    def outputs(self) -> int:
        """The number of flat outputs."""
        return 1 + max(c for c, _ in self._shifted)

    @property
    def orders(self) -> tuple[int, ...]:
        """By how many steps each flat output looks ahead; one at least."""
        return tuple(max(1, *(j for d, j in self._shifted if d == c)) for c in range(self.outputs))

    @cached_property
    def _shifted(self) -> set[tuple[int, int]]:
        return {indices(name) for formula in (*self.states, *self.inputs) for name in variables(formula)}


def named(c: int, j: int) -> str:
    """Return the name of z_c(k + j), with c from 0 on."""
    return f"z{c + 1}[{j}]"


def indices(name: str) -> tuple[int, int]:
    """Return c and j of a shifted flat output. ValueError: the name is no such name."""
    found = _SHIFTED.fullmatch(name)
    if not found:
        raise ValueError(f"flat form: formulas must be of flat outputs, z1[0] to z99[{MOST_SHIFTS}], but hold {name}")
    return int(found[1]) - 1, int(found[2])


def one_step_later(formula: Expression) -> Expression:
    """Return the formula with every flat output one step later."""
    later = {name: Variable(named(c, j + 1)) for name in variables(formula) for c, j in [indices(name)]}
    return substituted(formula, later)


@dataclass(frozen=True)
class _Shifts:
    """z, as functions of shifted flat outputs take it."""

    outputs: int

    def __getitem__(self, j: Any) -> Any:
        if not isinstance(j, int) or not 0 <= j < MOST_SHIFTS:
            raise ValueError(f"z[j] needs a step j from 0 to {MOST_SHIFTS - 1}, got {j!r}")
        return np.array([Symbol(Variable(named(c, j))) for c in range(self.outputs)], dtype=object)

    def __iter__(self) -> Any:
        raise ValueError("z has no end: take z[0], z[1], …")


# Split formulas that are affine in the inputs into drift and gains, and solve them for the inputs, by fixed rules.
#
# The checker derives the same formulas independently, so the rules are stated exactly (a zero part is None; a factor 1
# is left out; nothing else is simplified):
#
# - a formula without inputs is drift; an input alone has the gain 1;
# - sums and differences are split term by term; −b alone is −1 · b;
# - in a product, or a quotient with inputs only in the numerator, each part is multiplied or divided.
#
# x⁺ = f0 + G u is then solved for u; gains equal to the number 0 count as zero. While an equation has only one unknown
# input, the first such equation gives that input, (x⁺ − f0 − Σ known G u)/G. The rest is solved by Cramer's rule,
# inputs in their order. Determinants are expanded along their first row, Cramer's numerators along the replaced column.
#
# So every part of f occurs in the formula of some input: f is defined, and has one solution u, exactly where all these
# formulas are defined.

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


# Find flat forms: of chains, of blocks that hang together in a triangle, and of products of such.
#
# As many states as there are inputs are taken for flat outputs. While an equation x_i⁺ = f_i of a known x_i holds one
# unknown, f_i = a + b v, or a + b √v, it gives v: (x_i⁺ − a)/b, or the square of it, which is then claimed to be the
# square of something positive. Where none does, two or three equations that are affine in as many unknowns give these
# together, by Cramer's rule. If in the end all states and inputs are known, these are a flat form.

_MOST_CHOICES = 2000
_ROOT = "√"


def found_form(f: Sequence[Expression], states: Sequence[str], inputs: Sequence[str]) -> FlatForm | None:
    """Return the flat form whose flat outputs are the first states for which there is one; None if none is found."""
    if not inputs or comb(len(states), len(inputs)) > _MOST_CHOICES:
        return None
    choices = combinations(range(len(states)), len(inputs))
    return next((form for choice in choices if (form := _form_of_choice(f, states, inputs, choice)) is not None), None)


def _form_of_choice(
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
        found = _solved_alone(f[i], states[i], name, known)
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


def _solved_alone(
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


# Headings of flat forms without jumps: atan2 jumps by 2π where a vector crosses the direction of ±π.
#
# A heading matters up to whole turns, so that formulas that differ by whole turns serve as well. None of this has to be
# believed: the flat form that comes out is verified as every other one is.

_NOTHING, _QUARTER_TURN = Constant(0.0), pi / 2
_PARTS = 16  # of tan(φ/2): a heading jumps within 1/16 rad of where it should
_MOST_QUARTERS = 16
"""Cosines and sines of more quarter turns than these have no normal form (`formulas.normal`)."""


def without_jumps(form: FlatForm) -> FlatForm:
    """Return the form with formulas that do not jump where a heading crosses ±π; the form itself if none does.

    The difference of two headings becomes the angle from one vector to the other, in (−π, π]. Sine and cosine of a
    heading become y/|v| and x/|v|.
    """
    states, inputs = (tuple(map(_smooth, part)) for part in (form.states, form.inputs))
    if all(new is old for new, old in zip((*states, *inputs), (*form.states, *form.inputs), strict=True)):
        return form
    return replace(form, states=states, inputs=inputs)


def with_heading_in(form: FlatForm, state: int, bounds: Interval) -> FlatForm:
    """Return the form with a heading that jumps opposite to the middle of its `bounds` [rad], nearly.

    So no heading jumps inside of bounds that are up to 6.1 rad wide. The heading of v = (x, y) becomes n π/2 + the
    angle of v turned back by n π/2, where π/2 is atan2(1, 0), exactly. Where the nearest quarter turn is too far from
    the middle, an angle whose cosine and sine are rational is added. The form is returned as it is if the state is not
    the angle of a vector, and if its bounds are wider than a turn or more than 16 quarter turns from zero.
    """
    heading = form.states[state]
    if not isinstance(heading, Angle):
        return form
    middle = bounds.lower / 2 + bounds.upper / 2
    n = round(middle / _QUARTER_TURN)
    if abs(n) > _MOST_QUARTERS or bounds.width >= 2 * pi:
        return form
    turned: Expression = _turned_back(heading, n)
    more = middle - n * _QUARTER_TURN
    if (parts := round(_PARTS * tan(more / 2))) and abs(more) + bounds.width / 2 >= pi:
        turned = _turned_by(_turned_back(heading, n), parts)
    elif n == 0:
        return form
    if n:
        turned = Sum(Product(Constant(float(n)), Angle(ONE, _NOTHING)), turned)
    return replace(form, states=(*form.states[:state], turned, *form.states[state + 1 :]))


def _turned_back(heading: Angle, quarters: int) -> Angle:
    y, x = heading.y, heading.x
    return (heading, Angle(_negative(x), y), Angle(_negative(y), _negative(x)), Angle(x, _negative(y)))[quarters % 4]


def _turned_by(heading: Angle, parts: int) -> Expression:
    """Return φ + the heading turned back by φ with tan(φ/2) = parts/16, whose cosine and sine are rational."""
    a, b = Constant(float(_PARTS**2 - parts**2)), Constant(float(2 * _PARTS * parts))
    y, x = heading.y, heading.x
    back = Angle(Difference(Product(a, y), Product(b, x)), Sum(Product(a, x), Product(b, y)))
    return Sum(Angle(b, a), back)


def _negative(formula: Expression) -> Expression:
    found = minus(None, formula)
    assert found is not None
    return found


def _smooth(formula: Expression) -> Expression:
    """Return a formula without differences, sines and cosines of headings; the same object if it has none."""
    known: dict[int, Expression] = {}
    for node in all_nodes(formula):
        known[id(node)] = _smooth_node(node, [known[id(operand)] for operand in operands(node)])
    return known[id(formula)]


def _smooth_node(node: Expression, inner: list[Expression]) -> Expression:
    match node, inner:
        case Difference(Angle(), Angle()), [Angle(y, x), Angle(y0, x0)]:
            across = Difference(Product(x0, y), Product(y0, x))
            return Angle(across, Sum(Product(x0, x), Product(y0, y)))
        case Function("sin" | "cos" as name, Angle()), [Angle(y, x)]:
            length = Function("sqrt", Sum(Power(x, 2.0), Power(y, 2.0)))
            return Quotient(y if name == "sin" else x, length)
    unchanged = all(new is old for new, old in zip(inner, operands(node), strict=True))
    return node if unchanged else rebuilt(node, inner)
