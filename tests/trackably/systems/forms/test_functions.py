"""Angles, arc tangents and sizes: derivatives, enclosures and rounding bounds hold the truth."""

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.systems.formulas.random_expressions import many_digits
from trackably.checker.form import a_formula
from trackably.checker.formulas import evaluate as checker_evaluate
from trackably.checker.intervals import ONE, ZERO, between, exactly
from trackably.checker.intervals import UndefinedError as CheckerUndefined
from trackably.checker.models import Model, enclose
from trackably.checker.models import Models as CheckerModels
from trackably.checker.rounding import FormulaNeeds, FormulaValues
from trackably.checker.tail import slopes_of
from trackably.systems.formulas import derivative, evaluate_floats, to_lists
from trackably.systems.tracing import trace

FORMULAS = {
    "atan2": np.arctan2,
    "atan": lambda a, b: np.arctan(a * b),
    "hypot": np.hypot,
    "abs": lambda a, b: abs(a) + b,
    "tanh": lambda a, b: np.tanh(a + b),
    "tan": lambda a, b: np.tan(0.3 * a) * b,
    "turn": lambda a, b: np.arctan2(a * b - 0.3, a + b**2),
}
AT = [(0.7, 0.4), (-0.7, 0.4), (0.9, -0.2), (-0.05, 1.3), (1.7, 0.02), (-1.2, -0.3)]


def formula(name):
    return trace(lambda x, u: [FORMULAS[name](x[0], u[0])], ("a",), ("b",))[0]


def checkers(middle, half):
    return Model([exactly(middle), exactly(half)] + [ZERO] * 4, ZERO)


@pytest.mark.parametrize("name", FORMULAS)
def test_enclosures_contain_the_truth(name):
    """In Taylor models; and what float64 computes is off by no more than is tracked."""
    of, theirs = formula(name), a_formula(to_lists(formula(name)), "f")
    for a, b in AT:
        x = np.linspace(-1.0, 1.0, 5)
        with mp.workprec(200):
            true = [many_digits(of, {"a": a + 0.01 * s, "b": b - 0.02 * s}) for s in x.tolist()]
        mine = {"a": checkers(a, 0.01), "b": checkers(b, -0.02)}
        found = checker_evaluate(theirs, mine, CheckerModels(6))
        for s, value in zip(x.tolist(), true, strict=True):
            middle = sum((c * s**k for k, c in enumerate(found.coefficients)), ZERO)
            reach = found.missed.b + 2.0**-45
            assert (middle - reach).a <= float(value) <= (middle + reach).b
        errors = dict.fromkeys(mine, exactly(2.0**-50))
        tracked = FormulaValues(FormulaNeeds({}, errors, 0), 6).track(theirs, mine)
        for s, value in zip(x.tolist(), true, strict=True):
            off = float(evaluate_floats(of, {"a": np.array(a + 0.01 * s), "b": np.array(b - 0.02 * s)})) - value
            assert abs(off) <= float(tracked.error.b)


@pytest.mark.parametrize("name", FORMULAS)
def test_slopes_of_the_checker_are_those_of_the_prover(name):
    of, theirs = formula(name), a_formula(to_lists(formula(name)), "f")
    for a, b in AT:
        along = {"a": [ONE, ZERO], "b": [ZERO, ONE]}
        found = slopes_of(theirs, {"a": exactly(a), "b": exactly(b)}, along)
        at = {"a": np.array(a), "b": np.array(b)}
        for which, slope in zip("ab", found, strict=True):
            own = derivative(of, which)
            expected = float(evaluate_floats(own, at)) if own is not None else 0.0
            assert float(slope.mid) == pytest.approx(expected, rel=1e-12, abs=1e-14)


SINGULAR = {
    "the zero vector": ("atan2", (-0.1, 0.1), (-0.1, 0.1)),
    "across ±π": ("atan2", (-0.1, 0.1), (-1.0, -0.5)),
    "at a kink": ("abs", (-0.1, 0.2), (0.5, 0.6)),
    "length zero": ("hypot", (-0.1, 0.1), (0.0, 0.1)),
}


@pytest.mark.parametrize("which", SINGULAR)
def test_where_there_may_be_no_value_it_is_refused(which):
    name, a, b = SINGULAR[which]
    theirs = a_formula(to_lists(formula(name)), "f")
    with pytest.raises(CheckerUndefined):
        enclose(theirs, {"a": between(*a), "b": between(*b)})
    own = {k: checkers((v[0] + v[1]) / 2, (v[1] - v[0]) / 2) for k, v in (("a", a), ("b", b))}
    with pytest.raises(CheckerUndefined):
        checker_evaluate(theirs, own, CheckerModels(6))
