"""A system with its sets: which quantities are bounded, what they are called, and what is refused."""

from dataclasses import replace

import numpy as np

from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

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
