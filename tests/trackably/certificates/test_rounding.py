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


def off(reference, name, values: np.ndarray, exact_time) -> float:
    """How far the row of the states and inputs (n + m,) is from the quantity at a time."""
    plant = reference.plant
    row = block_diag(plant.state_set.rows, plant.input_set.rows)[[q.name for q in reference.quantities].index(name)]
    with mp.workdps(naive.DIGITS):
        return float(abs(mp.mpf(float(row @ values)) - naive.exactly(reference, name, exact_time)))


def values_at(reference, t: float) -> np.ndarray:
    return np.concatenate([reference.state_at(np.array(t)), reference.input_at(np.array(t))])


compact_case = partial(case, drawn=compact_kernel)
DRAWN = [(make, s) for make, count in ((case, 24), (general_case, 12), (compact_case, 8)) for s in range(count)]


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
            assert off(reference, name, values_at(reference, t), t) <= error
            own = reference.quantity(name)(reference.signals, np.array(t))
            with mp.workdps(naive.DIGITS):
                assert abs(mp.mpf(float(own)) - naive.exactly(reference, name, t)) <= error
        for k in rng.integers(0, 1000, 2).tolist():
            values = values_at(reference, float(reference.instants(np.array(k))))
            assert off(reference, name, values, naive.instant(reference, k)) <= error


def test_long_arrays_are_summed_term_by_term_too():
    """As one time is, whose errors are bounded: the faster sums of searches are not used."""
    reference, half = certified("example1").reference, 50_000
    k, near = np.arange(-half, half), slice(half, half + 60)
    window = reference.window(-half, 2 * half)
    np.testing.assert_array_equal(window.states[:-1], reference.state(k))
    np.testing.assert_array_equal(window.inputs, reference.input(k))
    np.testing.assert_array_equal(window.states[near], reference.state(k[near]))
    for name, error in evaluation_errors(reference, 1e3).items():
        for i in (half, half + 17):
            values = np.append(window.states[i], window.inputs[i])
            assert off(reference, name, values, naive.instant(reference, i - half)) <= error


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
