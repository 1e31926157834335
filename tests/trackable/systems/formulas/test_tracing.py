"""Python functions are traced into formulas once, or refused with the reason."""

import math

import numpy as np
import pytest

from trackable.systems.formulas.tracing import traced

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
    r"f must be written in \+ - \* / \*\* with numbers, and NumPy's exp, log, sqrt, sin, cos, tan, arctan, arctan2, "
    r"hypot, sinh, cosh, tanh, abs"
)
REFUSED = {
    "a comparison": (lambda x, u: [x[0] if x[0] > 1 else u[0]], f"{ONE_FORMULA}compares a value"),
    "an equality": (lambda x, u: [x[0] if x[0] == 1 else u[0]], f"{ONE_FORMULA}compares a value"),
    "a truth value": (lambda x, u: [x[0] if x[0] else u[0]], f"{ONE_FORMULA}branches on a value"),
    "where": (lambda x, u: [np.where(x[0] > 0, x[0], u[0])], f"{ONE_FORMULA}compares a value"),
    "a look-up": (lambda x, u: [{1.0: u[0]}[x[0]]], f"{ONE_FORMULA}looks a value up"),
    "a remainder": (lambda x, u: [x[0] % 2 + u[0]], f"{ONE_FORMULA}takes a remainder"),
    "rounding": (lambda x, u: [round(x[0]) + u[0]], f"{ONE_FORMULA}rounds a value"),
    "math.sqrt": (lambda x, u: [math.sqrt(x[0]) + u[0]], f"{ONE_FORMULA}makes a plain number of a value, as math.sqrt"),
    "arcsin": (lambda x, u: [np.arcsin(x[0]) + u[0]], f"{ORDINARY}; it uses np.arcsin"),
    "arcsin of arrays": (lambda x, u: np.arcsin(x) + u, f"{ORDINARY}: .*arcsin"),
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
