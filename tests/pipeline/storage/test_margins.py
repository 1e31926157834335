"""Margins in a log: no row hides what its sampling intervals have, and long ones have fewer rows."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.margins import MarginProfile
from pipeline.storage.archive import read_stage, write_margins
from pipeline.storage.results import Results
from tests.pipeline.committed import EXPERIMENTS

QUANTITY = EXPERIMENTS["example1"].plant.quantities[0]


@pytest.mark.parametrize(("count", "together"), [(1, 1), (1001, 1), (1002, 2), (2002, 2), (5001, 5), (5006, 6)])
def test_a_row_is_the_smallest_of_its_intervals(tmp_path: Path, count: int, together: int) -> None:
    rng = np.random.default_rng(count)
    T = QUANTITY.sampling_time
    margins, at_steps = rng.standard_normal((2, count))
    times = T * (np.arange(count) + rng.random(count))
    results = Results("example1", tmp_path)
    write_margins(results, {"some": [MarginProfile(QUANTITY, times, margins, at_steps)]}, {}, {})
    (series,) = read_stage(results, "verification").series
    assert len(series.times) <= 1001
    first = np.arange(0, count, together)
    least, at_step = (np.minimum.reduceat(values, first) for values in (margins, at_steps))
    np.testing.assert_array_equal(series.times, T * first)
    np.testing.assert_array_equal(series.fields["margin"], least)
    np.testing.assert_array_equal(series.fields["at_time"], times[np.isin(margins, least)])
    np.testing.assert_array_equal(series.fields["margin_at_step"], at_step)
