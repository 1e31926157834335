"""States and inputs of long arrays are summed term by term: that is the evaluation whose rounding is certified."""

import numpy as np
import pytest
from mpmath import mp

from tests.trackably.certificates import naive
from trackably.certificates.draft import evaluation_errors
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

CENTRES, HALF, STEP = 70, 50_000, 0.1


@pytest.fixture(scope="module")
def reference() -> Reference:
    """Steep kernels near time zero."""
    centres = STEP * np.arange(CENTRES)
    plant = ConstrainedSystem(
        LinearSystem([[0.9]], [[0.5]], states=("state",), inputs=("input",), sampling_time=STEP),
        Polytope.box([-9.0], [9.0]),
        Polytope.box([-9.0], [9.0]),
    )
    signal = KernelSum(SquaredExponential(1.0, 0.05), 0.0, centres, np.exp(-np.arange(CENTRES)))
    return Reference((signal,), plant)


@pytest.fixture(scope="module")
def times() -> np.ndarray:
    """A regular grid up to the rounding of its ends, which is large beside that of its times near zero."""
    start = -HALF * STEP
    return start + STEP * np.arange(2 * HALF)


@pytest.mark.parametrize("side", ["state", "input"])
def test_a_long_array_has_the_values_of_its_times_up_to_what_is_certified(reference, times, side) -> None:
    values = {"state": reference.state_at, "input": reference.input_at}[side](times)[:, 0]
    error = evaluation_errors(reference, 1e5)[side]
    for i in (HALF - 1, HALF, HALF + 1, HALF + 17, HALF + CENTRES):
        with mp.workdps(naive.DIGITS):
            assert float(abs(mp.mpf(float(values[i])) - naive.exactly(reference, side, times[i]))) <= error
