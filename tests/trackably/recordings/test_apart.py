"""Values at one time that are averaged though noise does not explain their distance are asked about; noise is not."""

import warnings

import numpy as np
import pytest

from tests.trackably.recordings.tables import findings, record, rows
from trackably import DoubtfulInputWarning
from trackably.recordings import Column, average_repeated, read_csv, sort_rows


def said(table):
    return [found.what for found in findings(record(table, sort_rows, average_repeated)) if found.is_doubtful]


@pytest.mark.parametrize("seed", range(3))
def test_two_sensors_at_each_time_are_asked_about_in_whatever_order_and_noise_is_not(seed):
    rng = np.random.default_rng(seed)
    both = np.stack([0.1 * rng.standard_normal(300), 3.0 + 0.1 * rng.standard_normal(300)], axis=1)
    mixed = rng.permuted(both, axis=1).ravel()
    stamps = [str(k // 2) for k in range(600)]
    assert len(said(rows(stamps, x=mixed.tolist()))) == 1
    alone = np.sin(np.arange(600) // 2 / 7) + 0.1 * rng.standard_normal(600)
    for noise in (None, [0.1] * 600):
        assert said(rows(stamps, noise=noise, x=alone.tolist())) == []


def test_readers_warn_and_average_nevertheless(tmp_path):
    lines = [f"{k},{float(np.sin(k / 5))!r}" for k in range(30)]
    (tmp_path / "twice.csv").write_text("\n".join(["t,x", *lines[:8], "7,9.0", *lines[8:]]), encoding="utf-8")
    with pytest.warns(DoubtfulInputWarning, match=r"values of x at one time .*: 1, first in line 9") as caught:
        recording = read_csv(tmp_path / "twice.csv", "t", "s", {"x": Column("x")}, repairs=["average_repeated"])
    assert caught[0].filename == __file__
    assert recording["x"].values[7] == (np.sin(7 / 5) + 9.0) / 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_csv(tmp_path / "twice.csv", "t", "s", {"x": Column("x")}, repairs=["keep_last_of_repeated"])
