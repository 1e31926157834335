"""Example 1 of the paper as its notes identify it, and what was printed of it."""

import numpy as np

from pipeline.generate import sampled_by
from pipeline.published.scalar import interval_sets
from tests.pipeline.committed import EXPERIMENTS
from tests.project import ROOT
from trackably.learning.constraint import Constraint
from trackably.learning.problem import ConstrainedProblem

_EXPERIMENT = EXPERIMENTS["example1"]
PUBLISHED = np.genfromtxt(ROOT / "data" / "paper" / "example1_prediction.csv", delimiter=",", names=True)

SYSTEM, PRIOR = _EXPERIMENT.plant, _EXPERIMENT.learned_prior
STATE_SET, INPUT_SET = interval_sets(SYSTEM)
(SAMPLES,) = sampled_by(_EXPERIMENT).samples
SPACE = _EXPERIMENT.search_space((SAMPLES,))
STEPS = np.arange(201)


def problem(*constraints: Constraint) -> ConstrainedProblem:
    return ConstrainedProblem((SAMPLES,), PRIOR, SPACE, constraints)
