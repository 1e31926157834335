"""Samples are checked once, on entry, by messages that name the offending entry."""

import numpy as np
import pytest

from trackably.gp.samples import Samples


@pytest.mark.parametrize(
    ("times", "values", "message"),
    [
        ([], [], r"times must be a non-empty one-dimensional array, got shape \(0,\)"),
        ([0.0, 1.0], [[1.0], [2.0]], r"values must be a non-empty one-dimensional array, got shape \(2, 1\)"),
        ([0.0, np.inf, np.nan], [0.0, 0.0, 0.0], r"times\[1\] must be finite, got inf"),
        ([0.0, 1.0], [-np.inf, 0.0], r"values\[0\] must be finite, got -inf"),
        ([0.0, 1.0], [0.0, 1.0, 2.0], r"as many times as values are needed, got 2 and 3"),
        ([0.0, 1.0, 1.0], [0.0, 0.0, 0.0], r"times\[2\] = 1 s repeats times\[1\] = 1 s"),
        ([0.0, 2.0, 1.5, 1.0], [0.0, 0.0, 0.0, 0.0], r"times\[2\] = 1\.5 s lies before times\[1\] = 2 s"),
    ],
)
def test_bad_samples_are_refused(times, values, message):
    with pytest.raises(ValueError, match=f"^samples: .*{message}$"):
        Samples(times, values)


def test_samples_are_a_copy_that_nobody_can_change():
    times = np.array([0.0, 1.0])
    samples = Samples(times, [2, 3], [0.5, 2])
    times[0] = 9.0
    assert samples.times.tolist() == [0.0, 1.0]
    assert samples.values.dtype == np.float64
    assert samples.relative_noise.tolist() == [0.5, 2.0]
    for kept in (samples.values, samples.relative_noise):
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 1.0
