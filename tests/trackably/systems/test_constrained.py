"""A system with its sets: which quantities are bounded, what they are called, and what is refused."""

from dataclasses import replace

import numpy as np

from tests.trackably.gp.instances import over
from tests.trackably.systems.nonlinear_instances import INSTANCES
from trackably.checker.formulas import Name, Operation
from trackably.gp.stencil import Stencil
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope
from trackably.systems.trajectories import Functional, Quantities, Trajectory

AXIS = LinearSystem(
    np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]]), states=("position", "velocity"), sampling_time=0.1
)
STATES = Polytope(np.array([[1.0, 0.0], [1.0, 0.5], [1.0, 0.0], [0.0, -1.0]]), -np.ones(4), np.array([1.0, 1, 2, 1]))
INPUTS = Polytope.box(np.array([-3.0]), np.array([4.0]))
PLANT = ConstrainedSystem(AXIS, STATES, INPUTS)


def test_each_row_is_a_quantity_with_a_name_of_its_own():
    """As it is written; rows that are written alike are numbered."""
    names = ["position", "position+0.5velocity", "position (2)", "-velocity", "u1"]
    assert [q.name for q in PLANT.quantities] == names
    nearly = Polytope(np.array([[1 / 3, -1.0], [0.33333, -1.0], [1.0, 1e-9]]), -np.ones(3), np.ones(3))
    names = ["0.333position-velocity", "0.333position-velocity (2)", "position+1e-09velocity", "u1"]
    assert [q.name for q in replace(PLANT, state_set=nearly).quantities] == names
    bounds = [Interval(-1, 1), Interval(-1, 1), Interval(-1, 2), Interval(-1, 1), Interval(-3, 4)]
    assert [q.bounds for q in PLANT.quantities] == bounds


OBLIQUE = Polytope([[1.0, 0.5], [0.3, -2.0]], [-9.0, -9.0], [9.0, 9.0])
VEHICLE = ConstrainedSystem(INSTANCES["vehicle"].system, OBLIQUE, OBLIQUE)
RISING = Polytope.box([-3.0], [PolynomialPieces.lines({0.0: 4.0, 3.0: 5.0})])
PUSHED = ConstrainedSystem(replace(AXIS, c=np.array([0.1, -0.2])), STATES, RISING)


@over({"linear": PLANT, "affine, with a bound that moves": PUSHED, "nonlinear": VEHICLE}, "plant")
def test_quantities_are_the_rows_of_the_states_and_inputs(plant):
    t, signals = np.linspace(0, 3, 31), [lambda t: np.sin(3 * t) + 0.2 * t, lambda t: np.cos(2 * t)]
    states, inputs = (
        np.stack([q(signals, t) for q in side]) for side in (plant.flatness.states, plant.flatness.inputs)
    )
    expected = np.vstack([plant.state_set.rows @ states, plant.input_set.rows @ inputs])
    np.testing.assert_allclose(np.stack([q(signals, t) for q in plant.quantities]), expected)
    together, which = Quantities(plant.quantities, signals), np.arange(len(t)) % len(expected)
    np.testing.assert_allclose(together.values(t), expected)
    margins = [plant.quantities[q].margin(signals, at) for q, at in zip(which, t, strict=True)]
    np.testing.assert_allclose(together.margins_of(which, t), margins)


def test_weights_of_a_sum_at_shifts_that_are_no_neighbours():
    weights = {"now": (1,), "later": (0, 0, 1)}
    total = Trajectory.of_formula(
        Operation("+", Name("now"), Name("later")),
        {name: Functional(0, (w,), 0.1) for name, w in weights.items()},
    )
    assert total.stencil == (0, Stencil((1.0, 0.0, 1.0), 0.1))
