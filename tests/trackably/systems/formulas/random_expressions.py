"""Random expressions in x and y, and their values in many digits and in balls."""

from flint import arb
from hypothesis import strategies as st
from mpmath import mp

from tests.balls.arithmetic import ball_arithmetic
from tests.balls.formulas import UndefinedError, at_balls
from tests.formulas import evaluate
from trackably.checker.formulas import (
    FUNCTIONS,
    SYMBOLS,
    Angle,
    Formula,
    Function,
    Name,
    Number,
    Operation,
    Power,
    parts,
)

numbers = st.floats(0.2, 3.0).map(lambda v: Number(round(v, 3)))
leaves = st.one_of(numbers, st.sampled_from([Name("x"), Name("y")]))


def _grown(inner):
    return st.one_of(
        st.builds(Operation, st.sampled_from(SYMBOLS), inner, inner),
        st.builds(Power, inner, st.sampled_from([-2.0, -1.0, 0.0, 0.5, 1.0, 1.7, 2.0, 3.0, 70.0])),
        st.builds(Function, st.sampled_from(FUNCTIONS), inner),
        st.builds(Angle, inner, inner),
    )


expressions = st.recursive(leaves, _grown, max_leaves=8)
points = st.tuples(st.floats(0.3, 2.0), st.floats(0.3, 2.0))


class _Digits:
    def constant(self, value):
        return mp.mpf(value)

    def over(self, a, b):
        return a / b

    def power(self, base, exponent):
        return mp.power(base, mp.mpf(exponent))

    def function(self, name, argument):
        return getattr(mp, name)(argument)

    def angle(self, y, x):
        return mp.atan2(y, x)


def many_digits(expression: Formula, values: dict):
    return evaluate(expression, {name: mp.mpf(v) for name, v in values.items()}, _Digits())


def in_balls(expression: Formula, values: dict):
    """Enclosure, or None where the formula is not certainly defined (or any part of it out of all proportion)."""
    with ball_arithmetic():
        found = None
        for node in parts(expression):
            try:
                found = at_balls(node, {name: arb(v) for name, v in values.items()})
            except UndefinedError:
                return None
            if not abs(found) < 1e6:
                return None
        return found
