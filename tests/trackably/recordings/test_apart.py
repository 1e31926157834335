"""Values at one time that are averaged though noise does not explain their distance are asked about; noise is not."""

import warnings
from pathlib import Path

import numpy as np
import pytest

from tests.trackably.recordings.tables import findings, record, rows
from trackably import DoubtfulInputWarning
from trackably.recordings import Column, Rows, average_repeated, read_csv, sort_rows

SEEDS = range(8)


def said(table: Rows) -> list[str]:
    return [found.what for found in findings(record(table, sort_rows, average_repeated)) if found.is_doubtful]


@pytest.mark.parametrize("seed", SEEDS)
def test_noise_is_not_asked_about(seed: int) -> None:
    rng = np.random.default_rng(seed)
    truth = np.sin(np.arange(60) / 7) * rng.uniform(0, 3)
    values, others = (of + 0.1 * rng.standard_normal(of.size) for of in (truth, truth[::2]))
    for noise in (None, [0.1] * 90):
        stamps = [*map(str, range(60)), *map(str, range(0, 60, 2))]
        assert said(rows(stamps, noise=noise, x=[*values.tolist(), *others.tolist()])) == []


@pytest.mark.parametrize("seed", SEEDS)
def test_two_sensors_at_each_time_are_asked_about_in_whatever_order(seed: int) -> None:
    rng = np.random.default_rng(seed)
    both = np.stack([0.1 * rng.standard_normal(300), 3.0 + 0.1 * rng.standard_normal(300)], axis=1)
    mixed = rng.permuted(both, axis=1).ravel()
    stamps = [str(k // 2) for k in range(600)]
    assert len(said(rows(stamps, x=mixed.tolist()))) == 1
    alone = 0.1 * rng.standard_normal(600)
    assert said(rows(stamps, x=alone.tolist())) == []


def test_readers_warn_and_average_nevertheless(tmp_path: Path) -> None:
    lines = [f"{k},{float(np.sin(k / 5))!r}" for k in range(30)]
    (tmp_path / "twice.csv").write_text("\n".join(["t,x", *lines[:8], "7,9.0", *lines[8:]]), encoding="utf-8")
    with pytest.warns(DoubtfulInputWarning, match=r"values of x at one time .*: 1, first in line 9") as caught:
        recording = read_csv(tmp_path / "twice.csv", "t", "s", {"x": Column("x")}, repairs=["average_repeated"])
    assert caught[0].filename == __file__
    assert recording["x"].values[7] == (np.sin(7 / 5) + 9.0) / 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_csv(tmp_path / "twice.csv", "t", "s", {"x": Column("x")}, repairs=["keep_last_of_repeated"])
