"""The table of constrained systems, with inputs that push either way, and signals to send through them."""

import numpy as np
from hypothesis import strategies as st

from pipeline.gp.radial import SquaredExponential
from pipeline.gp.signal import KernelSum
from pipeline.systems.interval import Interval
from pipeline.systems.scalar import ConstrainedSystem, ScalarLinear

SYSTEMS: dict[str, ScalarLinear] = {
    "example1": ScalarLinear(0.9, 0.5),
    "pulls": ScalarLinear(0.9, -0.5),
    "unstable": ScalarLinear(1.2, 0.3, 0.1),
    "integrator": ScalarLinear(1.0, -2.0),
    "oscillates": ScalarLinear(-0.7, 0.4, -0.2),
    "forgets": ScalarLinear(0.0, -1.5, 0.3),
}

PLANTS: dict[str, ConstrainedSystem] = {
    name: ConstrainedSystem(system, Interval(-2.0, 1.5), Interval(-0.4, 0.7), 0.05) for name, system in SYSTEMS.items()
}

SIGNAL = KernelSum(SquaredExponential(1.0, 0.3), 0.2, np.array([0.0, 0.4, 0.9]), np.array([0.5, -0.8, 0.3]))

_finite = st.floats(-5, 5)
_gain = st.floats(0.05, 5) | st.floats(-5, -0.05)


@st.composite
def intervals(draw):
    lower = draw(_finite)
    return Interval(lower, lower + draw(st.floats(0.01, 10)))


plants = st.builds(
    ConstrainedSystem,
    st.builds(ScalarLinear, _finite, _gain, _finite),
    intervals(),
    intervals(),
    st.floats(1e-3, 2),
)
