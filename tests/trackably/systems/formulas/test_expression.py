"""Expressions: one function in floats, balls, intervals and many digits; its derivative."""

import numpy as np
import pytest
from hypothesis import given, settings
from mpmath import mp

from tests.trackably.systems.formulas.random_expressions import expressions, in_balls, many_digits, points
from trackably.checker.form import a_formula
from trackably.checker.formulas import parts, text
from trackably.checker.intervals import iv
from trackably.checker.models import enclose
from trackably.systems.formulas import derivative, evaluate_floats, to_lists


def test_balls_intervals_and_floats_agree():
    examined, in_floats = [], []

    @settings(max_examples=150, deadline=None)
    @given(expressions, points)
    def law(expression, point):
        values = dict(zip("xy", point, strict=True))
        ball = in_balls(expression, values)
        if ball is None:
            return
        examined.append(expression)
        with mp.workdps(60):
            true = many_digits(expression, values)
            assert not isinstance(true, mp.mpc)
            middle, radius = mp.mpf(ball.mid().str(45, radius=False)), mp.mpf(float(ball.rad()))
            assert abs(true - middle) <= radius + abs(middle) * mp.mpf(10) ** -40 + mp.mpf(10) ** -40
            tree = a_formula(to_lists(expression), "f")
            interval = enclose(tree, {name: iv.mpf(v) for name, v in values.items()})
            assert mp.mpf(interval.a._mpi_[0]) <= true <= mp.mpf(interval.b._mpi_[1])
        seen = float(evaluate_floats(expression, {name: np.array(v) for name, v in values.items()}))
        conditions = [in_balls(node, values) for node in parts(expression)]
        if all(c is not None and 1e-3 < abs(float(c)) < 1e3 for c in conditions):
            in_floats.append(expression)
            assert seen == pytest.approx(float(true), rel=1e-8, abs=1e-8)

    law()
    assert len(examined) > 120
    assert len(in_floats) > 100


def test_derivatives_are_those_of_central_differences():
    examined = []

    @settings(max_examples=150, deadline=None)
    @given(expressions, points)
    def law(expression, point):
        values = dict(zip("xy", point, strict=True))
        if in_balls(expression, values) is None:
            return
        examined.append(expression)
        with mp.workdps(80):
            for name in "xy":
                slope, h = derivative(expression, name), mp.mpf(10) ** -25
                ends = [many_digits(expression, {**values, name: mp.mpf(values[name]) + s * h}) for s in (1, -1)]
                difference = (ends[0] - ends[1]) / (2 * h)
                found = mp.mpf(0) if slope is None else many_digits(slope, values)
                if abs(difference) < 1e30:
                    assert abs(found - difference) <= mp.mpf(10) ** -12 * (1 + abs(difference)), text(expression)

    law()
    assert len(examined) > 120
