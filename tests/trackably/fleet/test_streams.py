"""Fleets of long recordings: `learn_many` through `learn_stream`."""

import numpy as np
import pytest

from tests.trackably.fleet.recordings import KERNEL, PLANT
from trackably import Fleet, Proved, Samples, check, learn_many, learn_stream
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
