"""Plants and samples from which references are learned in one call."""

import numpy as np

from trackably import ConstrainedSystem, LinearSystem, Polytope, Samples, SquaredExponential

AXIS = ConstrainedSystem(
    LinearSystem.discretised([[0, 1], [0, 0]], [[0], [1]], 0.05, states=("position", "velocity"), inputs=("force",)),
    Polytope.box([-1.1, -1.0], [0.2, 1.0]),
    Polytope.box([-2.5], [2.5]),
)
SCALAR = ConstrainedSystem(  # that of the paper's Example 1
    LinearSystem([[0.9]], [[0.5]], sampling_time=0.01), Polytope.box([-2.0], [0.05]), Polytope.box([-0.5], [0.5])
)
SLIDE = ConstrainedSystem(
    LinearSystem.discretised(
        [[0, 1], [0, 0]], [[0], [1]], 0.02, states=("position", "velocity"), inputs=("acceleration",)
    ),
    Polytope.box([-0.2, -0.5], [0.2, 0.5]),
    Polytope.box([-1.0], [1.0]),
)


def moved(t):
    """Return where the axis is that is moved from -1 to 0 within 1.5 s."""
    return np.where(t < 1.5, -0.5 - 0.5 * np.cos(np.pi * t / 1.5), 0.0)


TIMES = np.linspace(0, 3, 16)
MOVED = moved(TIMES)
SAMPLES = Samples(TIMES, MOVED + 0.02 * np.random.default_rng(0).standard_normal(TIMES.size))
KERNEL = SquaredExponential()
CART = ConstrainedSystem(
    LinearSystem(np.eye(2) * 0.8, np.eye(2), states=("a", "b"), inputs=("p", "q"), sampling_time=0.1),
    Polytope.box([-2, -2], [2, 2]),
    Polytope.box([-1, -1], [1, 1]),
)
# Each state of this one shows both flat outputs.
MIXED = ConstrainedSystem(
    LinearSystem(
        [[0.5, 0.2, 0.1], [0.1, 0.6, 0.3], [0.2, 0.1, 0.7]], [[1.0, 0.3], [0.2, 1.0], [0.4, 0.5]], sampling_time=0.1
    ),
    Polytope.box([-9] * 3, [9] * 3),
    Polytope.box([-9] * 2, [9] * 2),
)
