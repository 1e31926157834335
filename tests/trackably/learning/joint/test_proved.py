"""Functions and hyperparameters that are learned together are proved, and keep their bounds in many digits."""

import numpy as np
import pytest

from tests.trackably.certificates import naive
from tests.trackably.learning.joint.instances import CASES
from trackably.certificates.certified import Certified, learn_certified
from trackably.checker.certificate import AllPhases
from trackably.learning.learner import JOINT
from trackably.learning.space import SearchSpace


@pytest.mark.parametrize("name", ["piecewise_polynomial3", "periodic", "mixed"])
def test_bounds_that_cost_something_are_kept_between_all_times(name):
    case = CASES[name]
    space = SearchSpace.around(case.samples, case.prior, 4)
    found = learn_certified(case.samples, case.prior, case.plant, space, learner=JOINT)
    assert isinstance(found, Certified), found.explanation
    assert found.solution.price > 0
    assert found.solution.active_bounds
    end = found.certificate.proof.end if isinstance(found.certificate.claim, AllPhases) else 6.0
    for quantity in found.reference.quantities:
        error = found.certificate.evaluation_error[quantity.name]
        assert naive.smallest(found.reference, quantity.name, np.linspace(0, end, 3001).tolist()) >= error
