"""Formulas: traced once, and the same function for floats, balls, intervals and many digits."""

import math

import numpy as np
import pytest
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp

from trackable.certificates.balls.arithmetic import ball_arithmetic
from trackable.certificates.balls.formulas import UndefinedError, at_balls
from trackable.checker import formulas as checked
from trackable.systems.formulas.algebra import derivative
from trackable.systems.formulas.evaluation import evaluate, evaluate_floats
from trackable.systems.formulas.expression import (
    BINARY,
    FUNCTIONS,
    Constant,
    Expression,
    Function,
    Power,
    Variable,
    all_nodes,
    size_and_depth,
    variables,
)
from trackable.systems.formulas.nested_lists import from_lists, to_lists
from trackable.systems.formulas.tracing import traced

numbers = st.floats(0.2, 3.0).map(lambda v: Constant(round(v, 3)))
leaves = st.one_of(numbers, st.sampled_from([Variable("x"), Variable("y")]))


def _grown(inner):
    return st.one_of(
        st.builds(lambda kind, a, b: kind(a, b), st.sampled_from(BINARY), inner, inner),
        st.builds(Power, inner, st.sampled_from([-2.0, -1.0, 0.0, 0.5, 1.0, 1.7, 2.0, 3.0, 70.0])),
        st.builds(Function, st.sampled_from(FUNCTIONS), inner),
    )


expressions = st.recursive(leaves, _grown, max_leaves=8)
points = st.tuples(st.floats(0.3, 2.0), st.floats(0.3, 2.0))


class _Digits:
    def constant(self, value):
        return mp.mpf(value)

    def power(self, base, exponent):
        return mp.power(base, mp.mpf(exponent))

    def function(self, name, argument):
        return getattr(mp, name)(argument)


def many_digits(expression: Expression, values: dict):
    return evaluate(expression, {name: mp.mpf(v) for name, v in values.items()}, _Digits())


def in_balls(expression: Expression, values: dict):
    """Enclosure, or None where the formula is not certainly defined (or any part of it out of all proportion)."""
    with ball_arithmetic():
        found = None
        for node in all_nodes(expression):
            try:
                found = at_balls(node, {name: arb(v) for name, v in values.items()})
            except UndefinedError:
                return None
            if not abs(found) < 1e6:
                return None
        return found


@settings(max_examples=150, deadline=None)
@given(expressions, points)
def test_balls_intervals_and_floats_agree(expression, point):
    values = dict(zip("xy", point, strict=True))
    ball = in_balls(expression, values)
    if ball is None:
        return
    with mp.workdps(60):
        true = many_digits(expression, values)
        assert not isinstance(true, mp.mpc)
        middle, radius = mp.mpf(ball.mid().str(45, radius=False)), mp.mpf(float(ball.rad()))
        assert abs(true - middle) <= radius + abs(middle) * mp.mpf(10) ** -40 + mp.mpf(10) ** -40
        tree = checked.formula(to_lists(expression), "f")
        interval = checked.evaluate(tree, {name: checked.iv.mpf(v) for name, v in values.items()}, checked.Intervals())
        assert mp.mpf(interval.a._mpi_[0]) <= true <= mp.mpf(interval.b._mpi_[1])
    seen = float(evaluate_floats(expression, {name: np.array(v) for name, v in values.items()}))
    conditions = [in_balls(node, values) for node in all_nodes(expression)]
    if all(c is not None and 1e-3 < abs(float(c)) < 1e3 for c in conditions):
        assert seen == pytest.approx(float(true), rel=1e-8, abs=1e-8)


@settings(max_examples=150, deadline=None)
@given(expressions, points)
def test_derivatives_are_those_of_central_differences(expression, point):
    values = dict(zip("xy", point, strict=True))
    if in_balls(expression, values) is None:
        return
    with mp.workdps(80):
        for name in "xy":
            slope, h = derivative(expression, name), mp.mpf(10) ** -25
            ends = [many_digits(expression, {**values, name: mp.mpf(values[name]) + s * h}) for s in (1, -1)]
            difference = (ends[0] - ends[1]) / (2 * h)
            found = mp.mpf(0) if slope is None else many_digits(slope, values)
            if abs(difference) < 1e30:
                assert abs(found - difference) <= mp.mpf(10) ** -12 * (1 + abs(difference)), str(expression)


def test_a_derivative_in_several_names_moves_them_together():
    x, y = Variable("x"), Variable("y")
    assert derivative(BINARY[1](x, y), "x", "y") == BINARY[1](Constant(1.0), Constant(1.0))
    assert derivative(x, "y") is None


@given(expressions)
def test_lists_return(expression):
    assert from_lists(to_lists(expression)) == expression


@pytest.mark.parametrize(
    "data",
    [
        True,
        None,
        math.nan,
        math.inf,
        10**400,
        [],
        ["+", 1.0],
        ["tanh", "x"],
        ["^", "x", "y"],
        ["^", "x", True],
        {},
        ["+"],
    ],
)
def test_what_is_no_formula_is_refused(data):
    with pytest.raises(ValueError, match="a formula must be a number, a name or a list"):
        from_lists(data)


def test_formulas_may_not_be_nested_too_deeply():
    data = "x"
    for _ in range(101):
        data = ["exp", data]
    with pytest.raises(ValueError, match="a formula must not be nested more than 100 deep"):
        from_lists(data)


@settings(max_examples=60, deadline=None)
@given(expressions, points)
def test_the_text_of_a_formula_is_the_formula(expression, point):
    values = dict(zip("xy", point, strict=True))
    if in_balls(expression, values) is None:
        return
    text = str(expression).replace("^", "**")
    with np.errstate(all="ignore"):
        found = eval(
            text, {name: getattr(np, name) for name in FUNCTIONS}, {n: np.float64(v) for n, v in values.items()}
        )
    assert float(found) == pytest.approx(float(evaluate_floats(expression, values)), rel=1e-9)


A = np.array([[1.0, 0.5], [0.0, 2.0]])
WRITTEN = {
    "sums": (lambda x, u: [x[0] + 2 * u[0] - 1, 3 - x[1]], ["a + 2 * p - 1", "3 - b"]),
    "matrices": (lambda x, u: A @ x + u, ["a + 0.5 * b + p", "0 * a + 2 * b + q"]),
    "numpy": (lambda x, u: [np.exp(x[0]) * np.sqrt(x[1]), np.float64(2.0) * x[0]], ["exp(a) * sqrt(b)", "2 * a"]),
    "arrays": (lambda x, u: np.log(x) / u, ["log(a) / p", "log(b) / q"]),
    "powers": (lambda x, u: [x[0] ** 2, 2 ** x[1]], ["a^2", "exp(b * log(2))"]),
    "signs": (lambda x, u: [-x[0], +x[1] - np.square(u[0])], ["(-1) * a", "b - p^2"]),
    "sums of lists": (lambda x, u: [sum(x), sum(u) * 1], ["a + b", "p + q"]),
    "hyperbolic": (lambda x, u: [np.tanh(x[0]), np.tan(x[1])], ["1 - 2 / (exp(2 * a) + 1)", "sin(b) / cos(b)"]),
    "a number": (lambda x, u: [1, np.array(2.5)], ["1", "2.5"]),
}


@pytest.mark.parametrize("name", WRITTEN)
def test_what_is_written_is_what_is_kept(name):
    f, texts = WRITTEN[name]
    assert [str(e) for e in traced(f, ("a", "b"), ("p", "q"))] == texts


def test_f_is_called_once():
    calls = []
    traced(lambda x, u: calls.append(1) or [x[0]], ("a",), ("p",))
    assert calls == [1]


ONE_FORMULA = "f must be one formula for all states and inputs, but it "
ORDINARY = (
    r"f must be written in \+ - \* / \*\* with numbers, and NumPy's exp, log, sqrt, sin, cos, tan, sinh, cosh, tanh"
)
REFUSED = {
    "a comparison": (lambda x, u: [x[0] if x[0] > 1 else u[0]], f"{ONE_FORMULA}compares a value"),
    "an equality": (lambda x, u: [x[0] if x[0] == 1 else u[0]], f"{ONE_FORMULA}compares a value"),
    "a truth value": (lambda x, u: [x[0] if x[0] else u[0]], f"{ONE_FORMULA}branches on a value"),
    "where": (lambda x, u: [np.where(x[0] > 0, x[0], u[0])], f"{ONE_FORMULA}compares a value"),
    "a look-up": (lambda x, u: [{1.0: u[0]}[x[0]]], f"{ONE_FORMULA}looks a value up"),
    "an absolute value": (lambda x, u: [abs(x[0]) + u[0]], f"{ONE_FORMULA}takes an absolute value"),
    "a remainder": (lambda x, u: [x[0] % 2 + u[0]], f"{ONE_FORMULA}takes a remainder"),
    "rounding": (lambda x, u: [round(x[0]) + u[0]], f"{ONE_FORMULA}rounds a value"),
    "math.sqrt": (lambda x, u: [math.sqrt(x[0]) + u[0]], f"{ONE_FORMULA}makes a plain number of a value, as math.sqrt"),
    "arctan": (lambda x, u: [np.arctan(x[0]) + u[0]], f"{ORDINARY}; it uses np.arctan"),
    "arctan of arrays": (lambda x, u: np.arctan(x) + u, f"{ORDINARY}: .*arctan"),
    "maximum": (lambda x, u: [np.maximum(x[0], 0) + u[0]], f"{ORDINARY}; it uses np.maximum"),
    "two exponents": (lambda x, u: [x[0] ** u[0]], "f must have numbers for exponents, or for positive bases"),
    "infinity": (lambda x, u: [x[0] + np.inf], "f must use numbers that are finite, and exact in float64, got inf"),
    "a long number": (lambda x, u: [x[0] + 2**53 + 1 + (2**53 + 1) * u[0]], "exact in float64, got 9007199254740993"),
    "a text": (lambda x, u: ["level"], "f must return numbers and formulas, got str"),
    "too few": (lambda x, u: [], "f must return a list of 1 successors, got 0 values"),
    "no list": (lambda x, u: x[0] + u[0], "f must return a list of 1 successors, got Symbol"),
    "nonsense": (lambda x, u: [x[0] + None], f"{ORDINARY}: unsupported operand"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_formula_is_refused_with_the_reason(name):
    f, reason = REFUSED[name]
    with pytest.raises(ValueError, match=reason):
        traced(f, ("a",), ("p",))


def test_what_is_shared_counts_each_time_it_is_written():
    x = Variable("x")
    for _ in range(40):
        x = BINARY[0](x, x)
    assert size_and_depth(x) == (2**41 - 1, 41)
    assert variables(x) == {"x"}
    assert float(evaluate_floats(x, {"x": np.array(1.0)})) == 2.0**40
