"""Python functions are traced into formulas that give their values, or refused with the reason."""

import math
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import numpy as np
import pytest
from hypothesis import given, reject, settings

from tests.formulas import evaluate
from tests.trackably.systems.formulas.random_expressions import expressions
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.tracing import require_same_values, trace

REFUSED = {
    "a comparison": (lambda x, u: [x[0] if x[0] > 1 else u[0]], "f must be one formula .*, but it compares a value"),
    "a truth value": (lambda x, u: [x[0] if x[0] else u[0]], "it branches on a value"),
    "math.sqrt": (lambda x, u: [math.sqrt(x[0]) + u[0]], "it converts a value to a plain number"),
    "solve": (lambda x, u: np.linalg.solve([[1 + x[0] ** 2]], u), "np.linalg takes plain numbers only; write"),
    "arcsin": (lambda x, u: [np.arcsin(x[0]) + u[0]], r"f must be written in \+ - \* / .* abs; it uses np.arcsin"),
    "a long number": (lambda x, u: [x[0] + 2**53 + 1 + (2**53 + 1) * u[0]], "exact in float64, got 9007199254740993"),
    "a state too many": (lambda x, u: [x[1]], r"f raises IndexError \(index 1 .*; it must be written in"),
    "too few": (lambda x, u: [], "f must return a list of 1 successors, got 0 values"),
}


def clamped(u):
    return max(-1.0, min(1.0, u))


def tolerant(x, u):
    """Clamp what can be clamped, and go on where it cannot."""
    try:
        return [x[0] + clamped(u[0])]
    except BaseException:
        return [x[0] + u[0]]


def hidden(x, u):
    """Return a successor that is another one where no number is drawn, and catch what says so."""
    try:
        jump = 5.0 if 1.0 < x[0] < 1.0001 else 0.0
    except BaseException:
        jump = 0.0
    return [x[0] + u[0] + jump]


def in_a_thread(call):
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call).result()


COUNTED, CALLED, KEPT = count(1), count(), dict[str, object]()
DISGUISED = {
    "clamped inside try": (tolerant, "it compares a value"),
    "hidden where no number is drawn": (hidden, "it compares a value"),
    "another thread": (lambda x, u: in_a_thread(lambda: [x[0] + clamped(u[0])]), "it compares a value"),
    "isinstance": (
        lambda x, u: [x[0] + (clamped(u[0]) if isinstance(x[0], float) else u[0])],
        "it gives a = .*, and its formula gives a = ",
    ),
    "an error": (
        lambda x, u: [x[0] + u[0]] if x.dtype == object else 1 // 0,
        r"it raises ZeroDivisionError \(.*\), and its formula gives a = ",
    ),
    "NaN": (lambda x, u: [x[0] + (u[0] if x.dtype == object else np.nan)], "it gives a = nan, and its formula"),
    "remembered": (lambda x, u: [x[0] + KEPT.setdefault("u", u[0])], "it raises Refusal"),
    "stateful": (lambda x, u: [x[0] + next(COUNTED) * u[0]], "all states, inputs and calls, but at .* it gives a = "),
    "another first call": (
        lambda x, u: [x[0] + (2 if next(CALLED) == 0 else 1) * u[0]],
        "all states, inputs and calls, but at .* it gives a = ",
    ),
}


@pytest.mark.parametrize(("f", "reason"), [*REFUSED.values(), *DISGUISED.values()], ids=[*REFUSED, *DISGUISED])
def test_what_is_no_formula_or_treats_symbols_in_another_way_is_refused_with_the_reason(f, reason):
    with pytest.raises(ValueError, match=reason):
        NonlinearSystem.of(f, ["a"], ["p"], 0.1)


DENSE = np.random.default_rng(0).normal(size=(8, 8))
HONEST = {
    "functions": lambda x, u: np.tanh(x) + np.sinh(u) + np.hypot(x, u) + np.arctan2(x, u) + np.tan(x) + abs(u),
    "powers": lambda x, u: 2.0**x + x**2.0 - np.square(u) * u**-0.5,
    "matrices": lambda x, u: DENSE[:4, :4] @ x + DENSE[:4, 4:] @ u + x.mean() + np.sum(u) + np.linalg.norm(x),
    "large terms": lambda x, u: 1e8 + x - 1e8 + 1e5 * np.sin(u),
    "plain lists": lambda x, u: [a + b * (1 - 0.2 * a) for a, b in zip(x.tolist(), list(u), strict=True)],
}


@pytest.mark.parametrize("name", HONEST)
def test_rounding_and_what_is_not_defined_are_no_other_values(name):
    f, names = HONEST[name], (tuple("abcd"), tuple("pqrs"))
    require_same_values(f, trace(f, *names), *names)


class Numbers:
    """NumPy's functions of numbers or symbols."""

    constant = staticmethod(float)
    over = staticmethod(lambda a, b: a / b)
    power = staticmethod(lambda base, exponent: base**exponent)
    function = staticmethod(lambda name, argument: getattr(np, {"atan": "arctan"}.get(name, name))(argument))
    angle = staticmethod(np.arctan2)


@given(expressions)
@settings(max_examples=25)
def test_no_formula_differs_from_itself(formula):
    def f(x, u):
        with np.errstate(all="ignore"):
            return [evaluate(formula, {"x": x[0], "y": u[0]}, Numbers)]

    try:
        formulas = trace(f, ("x",), ("y",))
    except (ValueError, OverflowError):
        reject()  # constants that are not finite
    require_same_values(f, formulas, ("x",), ("y",))
