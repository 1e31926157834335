"""Weighted sums of signals at shifted times: values, combinations, what they are at rest, how they see one signal."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.systems.trajectories import Functional, weighted_sum_of_functionals

TIMES = np.linspace(-0.2, 2.0, 45)
THIRD = Fraction(1, 3)
SIGNALS = (np.sin, np.cos, np.exp)


@st.composite
def same_shaped(draw, count: int):
    """Functionals of two signals that look at each equally often."""
    looks = draw(st.tuples(st.integers(0, 3), st.integers(0, 3)))
    number = st.fractions(-3, 3, max_denominator=50)
    step = draw(st.floats(0.01, 0.5))
    return [
        Functional(tuple(tuple(draw(number) for _ in range(n)) for n in looks), draw(number), step)
        for _ in range(count)
    ]


def naive(functional: Functional, signals, t: float) -> float:
    total = float(functional.offset)
    for weights, signal in zip(functional.weights, signals, strict=True):
        for j, w in enumerate(weights):
            total += float(w) * float(signal(np.array(t + j * functional.sampling_time)))
    return total


@given(same_shaped(1), st.floats(-1, 2))
def test_any_functional_against_a_loop(functionals, t):
    (functional,) = functionals
    assert functional(SIGNALS[:2], np.array(t)) == pytest.approx(naive(functional, SIGNALS[:2], t), abs=1e-12)


@given(same_shaped(3), st.lists(st.fractions(-3, 3, max_denominator=50), min_size=3, max_size=3))
def test_a_combination_has_the_combined_values(functionals, row):
    both = weighted_sum_of_functionals(row, functionals)
    expected = sum(float(r) * q(SIGNALS[:2], TIMES) for r, q in zip(row, functionals, strict=True))
    np.testing.assert_allclose(both(SIGNALS[:2], TIMES), np.broadcast_to(expected, TIMES.shape), atol=1e-11)
    assert both.offset == sum(r * q.offset for r, q in zip(row, functionals, strict=True))
    assert [len(w) for w in both.weights] == [len(w) for w in functionals[0].weights]


@given(same_shaped(1), st.floats(-5, 5), st.floats(-5, 5))
def test_at_rest_it_has_the_value_of_constant_signals(functionals, one, other):
    (functional,) = functionals
    constant = tuple(lambda t, level=level: np.full_like(t, level) for level in (one, other))
    at_rest = functional.at_rest([one, other])
    assert isinstance(at_rest, float)
    assert at_rest == pytest.approx(naive(functional, constant, 0.3), abs=1e-12)


def test_at_rest_nothing_is_lost_by_rounding():
    """1/3 + 1/3 + 1/3 is one."""
    assert Functional(((THIRD, THIRD, THIRD),), Fraction(-1), 0.1).at_rest([1.0]) == 0.0


@pytest.mark.parametrize(
    ("weights", "signal"),
    [
        (((Fraction(2), THIRD),), 0),
        (((), (THIRD,)), 1),
        (((Fraction(0), Fraction(0)), (Fraction(0), THIRD)), 1),
    ],
)
def test_one_signal_is_seen_through_a_stencil(weights, signal):
    functional = Functional(weights, Fraction(-3, 7), 0.05)
    found, stencil = functional.stencil
    assert found == signal
    assert stencil.weights == tuple(float(w) for w in weights[signal])
    assert (stencil.step, stencil.offset) == (0.05, -3 / 7)
    levels = [0.0, 0.0]
    levels[signal] = 1.7
    assert stencil.at_rest(1.7) == pytest.approx(functional.at_rest(levels[: len(weights)]), rel=1e-15)
