"""Flat outputs: whatever the signals are, the system follows; exactly. And what cannot be led is refused."""

from fractions import Fraction

import numpy as np
import pytest

from tests.trackably.gp.instances import over
from tests.trackably.systems.instances import SYSTEMS, controllable
from trackably.systems.linear import LinearSystem
from trackably.systems.rationals import exact, row_echelon
from trackably.systems.trajectories import Trajectory

T_S = 0.1

TABLE: dict[str, LinearSystem] = SYSTEMS | {
    "falling": LinearSystem.discretised(np.eye(2, k=1), np.eye(2)[:, 1:], T_S, np.array([0.0, -9.81])),
    "long_and_short": LinearSystem(np.eye(4, k=1) * [1, 1, 1, 0], np.eye(4)[:, 2:], np.arange(4.0), sampling_time=T_S),
    "leading_column_shared": LinearSystem(
        np.eye(4, k=1), np.array([[0, 0], [0, 1], [0, 1], [1, 1.0]]), sampling_time=T_S
    ),
    "redundant_input": LinearSystem(np.eye(3, k=1), np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 2.0]]), sampling_time=T_S),
    "idle_input": LinearSystem(np.array([[0.9]]), np.array([[0.5, 0.0]]), sampling_time=T_S),
    "forgets_all": LinearSystem(np.zeros((2, 2)), np.eye(2), np.array([1.0, -1.0]), sampling_time=T_S),
}
CASES = TABLE | {f"random_{seed}": controllable(seed, inputs=3) for seed in range(15)}
REDUNDANT = {name: system for name, system in CASES.items() if np.linalg.matrix_rank(system.B) < system.B.shape[1]}


def look(coordinates: tuple[Trajectory, ...], c: int, j: int) -> np.ndarray:
    """The weights of z_c(t + j T_s), zero where there is none."""
    weights = [q.functional.weights[c] for q in coordinates]
    return np.array([w[j] if 0 <= j < len(w) else Fraction(0) for w in weights])


def offsets(coordinates: tuple[Trajectory, ...]) -> np.ndarray:
    return np.array([q.functional.offset for q in coordinates])


@over(CASES, "system")
def test_the_system_follows_whatever_the_signals_are(system):
    """M_(j−1) = A M_j + B N_j for each signal, zeros beyond the ends, and x₀ = A x₀ + B u₀ + c: as fractions."""
    flat, A, B = system.flatness(), exact(system.A), exact(system.B)
    for c, order in enumerate(flat.orders):
        for j in range(order + 2):
            assert np.all(look(flat.states, c, j - 1) == A @ look(flat.states, c, j) + B @ look(flat.inputs, c, j))
    x, u = offsets(flat.states), offsets(flat.inputs)
    assert np.all(x == A @ x + B @ u + exact(system.c))


@over(CASES, "system")
def test_every_state_can_be_written(system):
    """As many looks at signals as states, each as late as its own chain is long, and the matrix from them to the states
    has an inverse.
    """
    flat, n = system.flatness(), len(system.states)
    assert (len(flat.states), len(flat.inputs)) == system.B.shape
    assert sum(flat.orders) == n
    assert len(flat.orders) == np.linalg.matrix_rank(system.B)
    columns = [look(flat.states, c, j) for c, order in enumerate(flat.orders) for j in range(order)]
    assert len(row_echelon(np.array(columns))[1]) == n
    assert all([*map(len, state.functional.weights)] == list(flat.orders) for state in flat.states)


@over(CASES, "system")
def test_flat_outputs_are_told_in_states(system):
    """Of states that are written in signals, row c is signal c, now, exactly; but for a constant."""
    flat = system.flatness()
    for c, order in enumerate(flat.orders):
        for j in range(order):
            told = exact(flat.outputs) @ look(flat.states, c, j)
            assert told.tolist() == [c == row and j == 0 for row in range(len(flat.orders))]


@over(REDUNDANT, "system")
def test_of_many_inputs_the_smallest_is_chosen(system):
    """By the pseudo-inverse: u = B⁺ B u, and so for each weight and the offset."""
    flat, smallest = system.flatness(), np.linalg.pinv(system.B) @ system.B
    weights = [look(flat.inputs, c, j) for c, order in enumerate(flat.orders) for j in range(order + 1)]
    for column in [*weights, offsets(flat.inputs)]:
        u = column.astype(float)
        np.testing.assert_allclose(smallest @ u, u, atol=1e-11 * (1 + np.max(np.abs(u))))


TWO, UP = np.diag([0.5, 0.8]), np.array([[0.0, 1.0], [0.0, 0.0]])


@pytest.mark.parametrize(
    ("A", "B", "message"),
    [
        (TWO, [[1.0], [0.0]], "must be controllable, .* reach 1 of 2 dimensions, and none of them ever changes x2"),
        (np.eye(2), [[1.0, 3.0], [2.0, 6.0]], "reach 1 of 2 dimensions, and none of them ever changes x1-0.5x2"),
        (np.eye(2) + 1e-14 * UP, [[0.0], [1.0]], r"nearly uncontrollable: .* condition number 2e\+14"),
        (np.eye(2), [[1.0, 1.0], [0.0, 1e-14]], "nearly uncontrollable: .* redundant inputs, give columns"),
    ],
)
def test_what_cannot_be_led_is_refused(A, B, message):
    with pytest.raises(ValueError, match=f"^system: .*{message}"):
        LinearSystem(A, B, sampling_time=T_S).flatness()


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_units_of_the_inputs_do_not_matter(scale):
    """An input in nanometres is as good as one in kilometres."""
    system = controllable(7)
    flat, scaled = (LinearSystem(system.A, system.B * s, system.c, sampling_time=T_S).flatness() for s in (1.0, scale))
    assert scaled.orders == flat.orders
    for c, order in enumerate(flat.orders):
        for j in range(order):
            ours, theirs = (look(f.states, c, j).astype(float) for f in (flat, scaled))
            np.testing.assert_allclose(theirs, ours, rtol=1e-9, atol=1e-9)
