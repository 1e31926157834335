"""Headings of flat forms without jumps: atan2 jumps by 2π where a vector crosses the direction of ±π.

A heading matters up to whole turns, so that formulas that differ by whole turns serve as well. None of this has to be
believed: the flat form that comes out is verified as every other one is.
"""

from dataclasses import replace
from math import pi, tan

from trackably.systems.flat.form import FlatForm
from trackably.systems.formulas.algebra import minus
from trackably.systems.formulas.expression import (
    ONE,
    Angle,
    Constant,
    Difference,
    Expression,
    Function,
    Power,
    Product,
    Quotient,
    Sum,
    all_nodes,
    operands,
)
from trackably.systems.formulas.substitution import rebuilt
from trackably.systems.sets.interval import Interval

_ZERO, _QUARTER_TURN = Constant(0.0), pi / 2
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
        turned = Sum(Product(Constant(float(n)), Angle(ONE, _ZERO)), turned)
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
