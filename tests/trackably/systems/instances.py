"""The table of constrained systems, with inputs that push either way, and signals to send through them."""

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st

from pipeline.published.scalar import scalar
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope

SYSTEMS: dict[str, LinearSystem] = {
    "example1": LinearSystem.scalar(0.9, 0.5, sampling_time=0.05),
    "pulls": LinearSystem.scalar(0.9, -0.5, sampling_time=0.05),
    "unstable": LinearSystem.scalar(1.2, 0.3, 0.1, sampling_time=0.05),
    "integrator": LinearSystem.scalar(1.0, -2.0, sampling_time=0.05),
    "oscillates": LinearSystem.scalar(-0.7, 0.4, -0.2, sampling_time=0.05),
    "forgets": LinearSystem.scalar(0.0, -1.5, 0.3, sampling_time=0.05),
}


def interval_box(bounds: Interval) -> Polytope:
    return Polytope.box(np.array([bounds.lower]), np.array([bounds.upper]))


def bounded(
    plant: ConstrainedSystem, *, state_set: Interval | None = None, input_set: Interval | None = None
) -> ConstrainedSystem:
    """A scalar system with other sets."""
    sets = {"state_set": state_set, "input_set": input_set}
    return replace(plant, **{name: interval_box(bounds) for name, bounds in sets.items() if bounds})


PLANTS: dict[str, ConstrainedSystem] = {
    name: ConstrainedSystem(system, interval_box(Interval(-2.0, 1.5)), interval_box(Interval(-0.4, 0.7)))
    for name, system in SYSTEMS.items()
}

SIGNAL = KernelSum(SquaredExponential(1.0, 0.3), 0.2, np.array([0.0, 0.4, 0.9]), np.array([0.5, -0.8, 0.3]))

_finite = st.floats(-5, 5)
_gain = st.floats(0.05, 5) | st.floats(-5, -0.05)


@st.composite
def intervals(draw):
    lower = draw(_finite)
    return Interval(lower, lower + draw(st.floats(0.01, 10)))


plants = st.builds(
    scalar,
    _finite,
    _gain,
    _finite,
    state_set=intervals(),
    input_set=intervals(),
    sampling_time=st.floats(1e-3, 2),
)


def controllable(seed: int, states: int = 4, inputs: int = 2) -> LinearSystem:
    """Up to so many states and inputs; a third stable, a third sparse (chains of different lengths), a third wild."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, states + 1)), int(rng.integers(1, inputs + 1))
    while True:
        A, B, c = rng.normal(size=(n, n)), rng.normal(size=(n, m)), rng.normal(size=n) * rng.integers(2)
        if seed % 3 == 0:
            A *= rng.uniform(0.3, 0.97) / np.max(np.abs(np.linalg.eigvals(A)))
        if seed % 3 == 1:
            A, B = (rng.choice([0, 0, 1, -1], size=matrix.shape) * matrix for matrix in (A, B))
        reached = np.hstack([np.linalg.matrix_power(A, k) @ B for k in range(n)])
        if np.linalg.matrix_rank(reached) == n and np.linalg.cond(reached) < 1e4:
            return LinearSystem(A, B, c, sampling_time=0.05)


def unbounded(system: LinearSystem | NonlinearSystem) -> ConstrainedSystem:
    n, m = len(system.states), len(system.inputs)
    sets = (Polytope(np.empty((0, d)), np.empty(0), np.empty(0), d) for d in (n, m))
    return ConstrainedSystem(system, *sets)


def random_signal(rng: np.random.Generator) -> KernelSum:
    kernels = SquaredExponential(1.0, 0.4), Matern52(0.7, 0.8), Periodic(1.0, 0.9, 2.3)
    centres = np.sort(rng.uniform(0, 3, 6))
    return KernelSum(kernels[int(rng.integers(3))], float(rng.normal()), centres, rng.normal(size=6))
