"""Values at one time that are averaged though noise does not explain their distance are asked about; noise is not."""

import numpy as np
import pytest

from tests.trackably.recordings.csv_files.files import read
from trackably import DoubtfulInputWarning
from trackably.recordings import Column

EACH = {"x": Column("x"), "known": Column("x", noise_std="s")}


def twice(values):
    """Two values at each time, and the noise that they have."""
    return "t,x,s\n" + "".join(f"{k // 2},{value!r},0.1\n" for k, value in enumerate(values.tolist()))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("column", EACH.values(), ids=EACH)
def test_two_sensors_at_each_time_are_asked_about_in_whatever_order_and_noise_is_not(tmp_path, seed, column):
    rng = np.random.default_rng(seed)
    both = 0.1 * rng.standard_normal((300, 2)) + [0.0, 3.0]
    how = {"signals": {"x": column}, "repairs": ["average_repeated"]}
    with pytest.warns(DoubtfulInputWarning, match="values of x at one time"):
        read(tmp_path / "a.csv", twice(rng.permuted(both, axis=1).ravel()), **how)
    alone = np.sin(np.arange(600) // 2 / 7) + 0.1 * rng.standard_normal(600)
    read(tmp_path / "a.csv", twice(alone), **how)
