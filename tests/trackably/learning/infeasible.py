"""Problems without a solution: the prior mean is no admissible equilibrium, and the samples are no help."""

from pipeline.published.scalar import scalar
from tests.trackably.learning.instances import Instance
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.systems.intervals import Interval

OPPOSITE = Samples([0.0, 0.2, 0.4, 0.6, 0.8], [-9.0, -11.0, -10.0, -10.5, -9.5])
NEAR = Samples([0.0, 0.2, 0.4, 0.6, 0.8], [0.3, 0.1, 0.2, 0.15, 0.1])
PRIOR = Prior(SquaredExponential(1.0, 1.0).as_learned(), 0.1)


def _infeasible(samples: Samples, system: tuple[float, ...], states: Interval, inputs: Interval) -> Instance:
    plant = scalar(*system, state_set=states, input_set=inputs, sampling_time=0.05)
    return Instance(samples, PRIOR, plant, 60)


INFEASIBLE = {
    "state": (_infeasible(OPPOSITE, (0.9, 0.5), Interval(1.0, 2.0), Interval(-5.0, 5.0)), "state", 0.0),
    "input": (
        _infeasible(NEAR, (1.0, -1.0, 1.0), Interval(-9.0, 9.0), Interval(-0.5, 0.4)),
        "input",
        1.0,
    ),
}
