"""What float64 evaluation gives lies within the error that is deducted from every margin."""

from functools import partial

import numpy as np
import pytest
from mpmath import mp
from scipy.linalg import block_diag

from tests.trackably.certificates import naive
from tests.trackably.certificates.instances import case, compact_kernel, general_case
from tests.trackably.certificates.references import certified
from trackably.certificates.draft import evaluated_until, evaluation_errors


def off(reference, name, t: float, exact_time) -> float:
    """As the quantity itself says, and as the row of the states or inputs."""
    plant, values = reference.plant, np.concatenate([reference.state_at(np.array(t)), reference.input_at(np.array(t))])
    rows = block_diag(plant.state_set.rows, plant.input_set.rows)
    which = [q.name for q in reference.quantities].index(name)
    with mp.workdps(naive.DIGITS):
        exact = naive.exactly(reference, name, exact_time)
        evaluated = reference.quantities[which](reference.signals, np.array(t)), rows[which] @ values
        return max(float(abs(mp.mpf(float(value)) - exact)) for value in evaluated)


compact_case = partial(case, drawn=compact_kernel)
DRAWN = [(make, s) for make, count in ((case, 16), (general_case, 8), (compact_case, 6)) for s in range(count)]


@pytest.mark.parametrize(("make", "seed"), DRAWN)
def test_errors_are_bounded(make, seed):
    chosen, rng = make(seed), np.random.default_rng(seed)
    reference = chosen.reference
    until = evaluated_until(reference, chosen.end)
    errors = evaluation_errors(reference, until)
    latest = min(until, 1e3 * chosen.end)
    times = np.concatenate([rng.uniform(0, chosen.end, 4), rng.uniform(0, latest, 2), -rng.uniform(0, latest, 1)])
    for name, error in errors.items():
        for t in times.tolist():
            assert off(reference, name, t, t) <= error
        for k in rng.integers(0, 1000, 2).tolist():
            assert off(reference, name, float(reference.instants(np.array(k))), naive.instant(reference, k)) <= error


@pytest.mark.parametrize("example", ["example1", "example2"])
def test_errors_are_small_where_it_matters(example):
    found = certified(example)
    for quantity in found.reference.quantities:
        assert found.certificate.evaluation_error[quantity.name] < 1e-7 * quantity.bounds.width


@pytest.mark.parametrize("example", ["example1", "example2"])
def test_evaluated_references_stay_inside(example):
    found = certified(example)
    times = np.concatenate([np.linspace(0, 5, 20_001), np.geomspace(5, found.certificate.evaluated_until, 2000)])
    for quantity in found.reference.quantities:
        assert np.min(quantity.bounds.margin(quantity(found.reference.signals, times))) >= 0
