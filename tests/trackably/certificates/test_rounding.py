"""What float64 evaluation gives lies within the error that is deducted from every margin."""

from functools import partial

import numpy as np
import pytest

from tests.trackably.certificates import naive
from tests.trackably.certificates.instances import case, compact_kernel, general_case
from tests.trackably.certificates.references import certified
from trackably.certificates.draft import evaluated_until, evaluation_errors

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
    for name, off in naive.evaluated(reference, times.tolist(), rng.integers(0, 1000, 4).tolist()):
        assert off <= errors[name]


def test_long_arrays_are_summed_term_by_term_too():
    """As one time is, whose errors are bounded: the faster sums of searches are not used."""
    reference, half = certified("example1").reference, 50_000
    k, near = np.arange(-half, half), slice(half, half + 60)
    window = reference.window(-half, 2 * half)
    np.testing.assert_array_equal(window.states[:-1], reference.state(k))
    np.testing.assert_array_equal(window.inputs, reference.input(k))
    np.testing.assert_array_equal(window.states[near], reference.state(k[near]))


@pytest.mark.parametrize("example", ["example1", "example2"])
def test_errors_are_small_where_it_matters_and_evaluated_references_stay_inside(example):
    found = certified(example)
    times = np.concatenate([np.linspace(0, 5, 20_001), np.geomspace(5, found.certificate.evaluated_until, 2000)])
    for quantity in found.reference.quantities:
        assert found.certificate.evaluation_error[quantity.name] < 1e-7 * quantity.bounds.width
        assert np.min(quantity.bounds.margin(quantity(found.reference.signals, times))) >= 0
