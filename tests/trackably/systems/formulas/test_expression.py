"""Expressions: one function in floats, balls, intervals, Taylor models and many digits; and its derivatives."""

from collections import Counter

import pytest
from hypothesis import given, settings
from mpmath import mp

from tests.trackably.systems.formulas.random_expressions import expressions, in_balls, many_digits, points
from trackably.checker.form import a_formula
from trackably.checker.formulas import Formula, parts, text
from trackably.checker.intervals import ONE, ZERO, UndefinedError, exactly, iv
from trackably.checker.models import Model, enclose
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.checker.tail import slopes_of
from trackably.systems.formulas import evaluate_floats, slopes_in_floats, to_lists

TERMS, REACH = 6, {"x": 0.01, "y": -0.02}
INPUT_ERROR = exactly(2.0**-50)


def test_every_arithmetic_holds_the_true_value_and_derivatives_are_those_of_differences():
    examined = Counter()

    @settings(max_examples=60, deadline=None)
    @given(expressions, points)
    def law(expression, point):
        values = dict(zip("xy", point, strict=True))
        ball = in_balls(expression, values)
        if ball is None:
            return
        tree = a_formula(to_lists(expression), "f")
        with mp.workdps(80):
            true = many_digits(expression, values)
            assert not isinstance(true, mp.mpc)
            middle, radius = mp.mpf(ball.mid().str(45, radius=False)), mp.mpf(float(ball.rad()))
            assert abs(true - middle) <= radius + abs(middle) * mp.mpf(10) ** -40 + mp.mpf(10) ** -40
            interval = enclose(tree, {name: iv.mpf(v) for name, v in values.items()})
            assert mp.mpf(interval.a._mpi_[0]) <= true <= mp.mpf(interval.b._mpi_[1])
            examined.update(defined=1, models=models_hold(tree, values))
            conditions = [in_balls(node, values) for node in parts(expression)]
            is_sane = all(c and 1e-3 < abs(float(c)) < 1e3 for c in conditions)
            assert_slopes_are_those_of_differences(expression, values, is_sane)
        seen = float(evaluate_floats(expression, values))
        if is_sane:
            examined.update(floats=1)
            assert seen == pytest.approx(float(true), rel=1e-8, abs=1e-8)

    law()
    assert examined["defined"] > 45
    assert min(examined["floats"], examined["models"]) > 25


def models_hold(tree: Formula, values: dict[str, float]) -> bool:
    """A Taylor model around the values contains the truth, and what float64 computes is off by no more than is tracked.

    False where the formula may have no value near by.
    """
    around = {
        name: Model([exactly(v), exactly(REACH[name])] + [ZERO] * (TERMS - 2), ZERO) for name, v in values.items()
    }
    try:
        model, error = FormulaValues(FormulaNeeds({}, dict.fromkeys(around, INPUT_ERROR), 0), TERMS).track(tree, around)
    except UndefinedError:
        return False
    for s in (-1.0, 0.3, 1.0):
        at = {name: v + REACH[name] * s for name, v in values.items()}
        true = many_digits(tree, at)
        middle = sum((c * s**k for k, c in enumerate(model.coefficients)), ZERO)
        missed = model.missed.b + error.b  # the error also holds the rounding of `at`
        assert (middle - missed).a <= float(true) <= (middle + missed).b
        off = float(evaluate_floats(tree, at)) - true
        assert abs(off) <= float(error.b)
    return True


def assert_slopes_are_those_of_differences(expression: Formula, values: dict[str, float], is_sane: bool) -> None:
    """Derivatives in float64, if it is accurate, and those that the checker encloses, against central differences."""
    along, h = {"x": [ONE, ZERO], "y": [ZERO, ONE]}, mp.mpf(10) ** -25
    checked = slopes_of(expression, {name: exactly(v) for name, v in values.items()}, along)
    seen = slopes_in_floats(expression, values)
    for name, slope in zip("xy", checked, strict=True):
        ends = [many_digits(expression, {**values, name: mp.mpf(values[name]) + s * h}) for s in (1, -1)]
        difference = (ends[0] - ends[1]) / (2 * h)
        if abs(difference) < 1e30:
            for of, digits in [(slope.mid._mpi_[0], 12), (float(seen.get(name, 0.0)), 7)][: 1 + is_sane]:
                assert abs(mp.mpf(of) - difference) <= mp.mpf(10) ** -digits * (1 + abs(difference)), text(expression)
