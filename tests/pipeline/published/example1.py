"""Example 1 of the paper as its notes identify it, and what was printed of it."""

import numpy as np

from pipeline.published.scalar import interval_sets, scalar
from tests.project import ROOT
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.space import SearchSpace
from trackably.systems.intervals import Interval

_PAPER = ROOT / "data" / "paper"


def _table(name: str) -> dict[str, np.ndarray]:
    table = np.genfromtxt(_PAPER / name, delimiter=",", names=True)
    return {column: table[column] for column in table.dtype.names}


_SAMPLES = _table("example1_samples.csv")
PUBLISHED = _table("example1_prediction.csv")

SYSTEM = scalar(0.9, 0.5, state_set=Interval(-2.0, 0.05), input_set=Interval(-0.5, 0.5), sampling_time=0.01)
STATE_SET, INPUT_SET = interval_sets(SYSTEM)
SAMPLES = Samples(_SAMPLES["k"] * 0.01, _SAMPLES["y"])
PRIOR = JointPrior((Prior(SquaredExponential(1.0, 1.0).as_learned(), noise_std=0.01),))
SPACE = SearchSpace.around((SAMPLES,), PRIOR)
STEPS = np.arange(201)


def problem(*constraints: Constraint) -> ConstrainedProblem:
    return ConstrainedProblem((SAMPLES,), PRIOR, SPACE, constraints)
