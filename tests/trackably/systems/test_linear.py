"""Linear systems: what is refused, dynamics, and exact discretisation against SciPy and closed forms."""

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete

from tests.trackably.gp.instances import over
from trackably.systems.linear import LinearSystem

A2, B2 = np.array([[0.0, 1.0], [-2.0, -3.0]]), np.array([[0.0], [1.0]])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros((2, 3)), B2), "A must be a square matrix, got shape (2, 3)"),
        ((np.zeros(2), B2), "A must be a square matrix, got shape (2,)"),
        ((np.zeros((0, 0)), B2), "A must be a square matrix, got shape (0, 0)"),
        ((A2, np.zeros((3, 1))), "B must have as many rows as A, 2, and a column for each input, got shape (3, 1)"),
        ((A2, np.zeros(2)), "B must have as many rows as A, 2, and a column for each input, got shape (2,)"),
        ((A2, np.zeros((2, 0))), "B must have as many rows as A, 2, and a column for each input, got shape (2, 0)"),
        ((A2, B2, np.zeros(3)), "c must have shape (2,), got (3,)"),
        ((A2, B2, np.zeros((2, 1))), "c must have shape (2,), got (2, 1)"),
        ((np.diag([1.0, np.inf]), B2), "A must be finite, got [[1.0, 0.0], [0.0, inf]]"),
        ((A2, np.array([[np.nan], [1.0]])), "B must be finite, got [[nan], [1.0]]"),
        ((A2, B2, np.array([0.0, np.inf])), "c must be finite, got [0.0, inf]"),
        ((A2, B2, np.zeros(2), ("p",)), "2 states and 1 inputs need as many different names, got ('p',), ('u1',)"),
        (
            (A2, B2, np.zeros(2), ("p", "p")),
            "2 states and 1 inputs need as many different names, got ('p', 'p'), ('u1',)",
        ),
        (
            (A2, B2, np.zeros(2), ("p", "v"), ("p",)),
            "2 states and 1 inputs need as many different names, got ('p', 'v'), ('p',)",
        ),
        (
            (A2, B2, np.zeros(2), ("p", "v"), ("a", "b")),
            "2 states and 1 inputs need as many different names, got ('p', 'v'), ('a', 'b')",
        ),
    ],
)
def test_impossible_systems_are_refused(arguments, message):
    with pytest.raises(ValueError, match=f"^system: {re.escape(message)}$"):
        LinearSystem(*arguments, sampling_time=0.1)


@pytest.mark.parametrize("wrong", [0.0, -0.1, np.nan, np.inf])
def test_a_sampling_time_is_positive_and_finite(wrong):
    with pytest.raises(ValueError, match=f"^system: sampling_time must be a positive finite number, got {wrong}$"):
        LinearSystem(A2, B2, sampling_time=wrong)


def test_what_is_left_out():
    system = LinearSystem(np.eye(3), np.ones((3, 2)), sampling_time=0.1)
    assert (system.states, system.inputs) == (("x1", "x2", "x3"), ("u1", "u2"))
    np.testing.assert_array_equal(system.c, np.zeros(3))
    assert (
        LinearSystem.scalar(0.5, 1.0, sampling_time=0.1).states,
        LinearSystem.scalar(0.5, 1.0, sampling_time=0.1).inputs,
    ) == (("state",), ("input",))


def test_a_system_is_a_copy_that_nobody_can_change():
    A = A2.copy()
    system = LinearSystem(A, B2, sampling_time=0.1)
    A[0, 0] = 9.0
    assert system.A[0, 0] == 0.0
    for array in (system.A, system.B, system.c):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


@pytest.mark.parametrize("shape", [(), (5,), (2, 3)])
def test_successors_against_a_loop(shape):
    rng = np.random.default_rng(0)
    system = LinearSystem(rng.normal(size=(3, 3)), rng.normal(size=(3, 2)), rng.normal(size=3), sampling_time=0.1)
    x, u = rng.normal(size=(*shape, 3)), rng.normal(size=(*shape, 2))
    found = system.successor(x, u)
    assert found.shape == (*shape, 3)
    for where in np.ndindex(shape):
        for i in range(3):
            expected = system.c[i] + sum(system.A[i, j] * x[where][j] for j in range(3))
            expected += sum(system.B[i, j] * u[where][j] for j in range(2))
            assert found[where][i] == pytest.approx(expected, abs=1e-14)


CONTINUOUS = {
    "damped": (A2, B2, np.zeros(2)),
    "integrators": (np.array([[0.0, 1.0], [0.0, 0.0]]), B2, np.array([0.3, -9.81])),
    "unstable": (np.array([[1.0, 2.0], [0.5, -1.0]]), np.array([[1.0, 0.0], [0.3, 2.0]]), np.array([0.1, 0.2])),
    "nothing": (np.zeros((1, 1)), np.zeros((1, 1)), np.array([2.0])),
}


@over(CONTINUOUS, "system")
@pytest.mark.parametrize("sampling_time", [0.01, 0.5, 3.0])
def test_discretised_as_scipy_does(system, sampling_time):
    """Drift enters as one more input, held at one."""
    A, B, c = system
    n, m = B.shape
    found = LinearSystem.discretised(A, B, sampling_time, c)
    wider = np.hstack([B, c[:, None]])
    discrete, held, *_ = cont2discrete((A, wider, np.eye(n), np.zeros((n, m + 1))), sampling_time)
    np.testing.assert_allclose(found.A, discrete, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(found.B, held[:, :m], rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(found.c, held[:, m], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("t_s", [0.01, 0.1, 2.0])
def test_closed_forms(t_s):
    axis = LinearSystem.discretised(np.array([[0.0, 1.0], [0.0, 0.0]]), B2, t_s, np.array([0.0, -9.81]))
    np.testing.assert_allclose(axis.A, [[1.0, t_s], [0.0, 1.0]], rtol=1e-15)
    np.testing.assert_allclose(axis.B, [[t_s**2 / 2], [t_s]], rtol=1e-14)
    np.testing.assert_allclose(axis.c, [-9.81 * t_s**2 / 2, -9.81 * t_s], rtol=1e-14)
    lag = LinearSystem.discretised(np.array([[-0.7]]), np.array([[2.0]]), t_s, np.array([0.3]))
    decay, filled = np.exp(-0.7 * t_s), (1 - np.exp(-0.7 * t_s)) / 0.7
    assert (lag.A.item(), lag.B.item(), lag.c.item()) == pytest.approx((decay, 2 * filled, 0.3 * filled), rel=1e-14)
    turn = LinearSystem.discretised(np.array([[0.0, 2.0], [-2.0, 0.0]]), B2, t_s)
    np.testing.assert_allclose(
        turn.A, [[np.cos(2 * t_s), np.sin(2 * t_s)], [-np.sin(2 * t_s), np.cos(2 * t_s)]], atol=1e-14
    )
    np.testing.assert_allclose(turn.B[:, 0], [(1 - np.cos(2 * t_s)) / 2, np.sin(2 * t_s) / 2], atol=1e-14)


@over(CONTINUOUS, "system")
def test_discretised_systems_go_where_the_continuous_ones_do(system):
    A, B, c = system
    x, u = np.full(len(A), 0.7), np.full(B.shape[1], -0.4)
    solved = solve_ivp(lambda _, y: A @ y + B @ u + c, (0, 0.3), x, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(LinearSystem.discretised(A, B, 0.3, c).successor(x, u), solved.y[:, -1], atol=1e-9)


def test_discretised_systems_keep_their_names():
    system = LinearSystem.discretised(A2, B2, 0.1, states=("position", "velocity"), inputs=("force",))
    assert (system.states, system.inputs) == (("position", "velocity"), ("force",))


def test_an_impossible_continuous_system_is_refused():
    with pytest.raises(ValueError, match=r"^system: A must be a square matrix"):
        LinearSystem.discretised(np.zeros((2, 3)), B2, 0.1)


def test_inputs_that_push_alike_do_so_when_discretised():
    A = np.random.default_rng(0).normal(size=(3, 3))
    b, other = A @ np.array([1.0, 0.3, -0.2]), np.array([0.1, 0.0, 1.0])
    for count, B in (
        (4, [b, other, -b, b / 4]),
        (3, [other, b, 2 * b]),
        (3, [b, other, 3 * b]),
        (2, [0 * b, b]),
        (3, [b, other, b + other]),
    ):
        discrete = LinearSystem.discretised(A, np.column_stack(B), 0.1)
        direct = LinearSystem.discretised(A, np.column_stack([b, other]), 0.1).B
        assert discrete.B.shape == (3, count)
        np.testing.assert_allclose(
            discrete.B, direct @ np.linalg.lstsq(np.column_stack([b, other]), np.column_stack(B))[0], atol=1e-15
        )
    nearly = np.array([1.0, 2.0, 0.0])
    for last in np.eye(3):
        separate = LinearSystem.discretised(A, np.column_stack([nearly, nearly + last]), 0.1).B
        assert np.linalg.matrix_rank(separate) == 2
    alike = LinearSystem.discretised(A, np.column_stack([b, other, -b, b / 4]), 0.1).B
    np.testing.assert_array_equal(alike[:, 2], -alike[:, 0])
    np.testing.assert_array_equal(4 * alike[:, 3], alike[:, 0])
