"""Fleets of long recordings: `learn_many` through `learn_stream`."""

import numpy as np
import pytest

from tests.trackably.fleet.recordings import KERNEL, PLANT
from tests.trackably.fleet.test_learn_many import contents, written
from trackably import Fleet, Proved, Samples, Truth, check, learn_many, learn_stream
from trackably.errors import InputError

TIMES = 0.02 * np.arange(70)


def learned(folder, count=2, **options) -> Fleet:
    of = {
        f"run {i}": Samples(TIMES, -0.3 * np.sin(4 * TIMES + i) ** 2 + 0.01 * np.random.default_rng(i).normal(size=70))
        for i in range(count)
    }
    given = {"learn": learn_stream, "window": 1.0, "noise_std": 0.01, "mean": -0.15, **options}
    return learn_many(of, PLANT, KERNEL, "recorded", folder=folder, **given)


def test_each_recording_is_a_stream_that_is_proved_and_loaded(tmp_path):
    fleet = learned(tmp_path)
    assert [(row.outcome, row.method, row.price) for row in fleet.rows] == [("proved", "stream", None)] * 2
    assert fleet.stream("run 1").fingerprint == fleet.rows[1].fingerprint
    assert isinstance(check(tmp_path / "run 1" / "certificate.json"), Proved)
    assert [key for key in fleet.columns() if "misfit" in key] == ["misfit [state]"]
    with pytest.raises(InputError, match=r"call fleet\.stream\('run 0'\)"):
        fleet.reference("run 0")


def test_each_certificate_speaks_of_the_true_signal(tmp_path):
    """|f'| ≤ 0.3 · 4 = 1.2."""
    learned(tmp_path, 1, truth=Truth(noise=0.05, slope=1.25))
    assert "The true signal: every f with" in check(tmp_path / "run 0" / "certificate.json").statement


def test_nothing_is_done_twice_and_two_workers_write_the_same_bytes(tmp_path):
    learned(tmp_path / "one")
    before = written(tmp_path / "one")
    learned(tmp_path / "one")
    assert written(tmp_path / "one") == before
    learned(tmp_path / "two", workers=2)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")
