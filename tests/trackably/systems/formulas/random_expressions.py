"""Random expressions in x and y, and their values in many digits and in balls."""

from flint import arb
from hypothesis import strategies as st
from mpmath import mp

from tests.balls.arithmetic import ball_arithmetic
from tests.balls.formulas import UndefinedError, at_balls
from trackably.systems.expressions import (
    BINARY,
    FUNCTIONS,
    Constant,
    Expression,
    Function,
    Power,
    Variable,
    all_nodes,
    evaluate,
)

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
