"""Fleets of long recordings: `learn_many` through `learn_stream`."""

import numpy as np
import pytest

from tests.trackably.fleet.recordings import KERNEL, PLANT
from tests.trackably.fleet.test_learn_many import contents, written
from trackably import Fleet, Proved, Samples, check, learn_many, learn_reference, learn_stream
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


def test_nothing_is_done_twice_and_two_workers_write_the_same_bytes(tmp_path):
    learned(tmp_path / "one")
    before = written(tmp_path / "one")
    learned(tmp_path / "one")
    assert written(tmp_path / "one") == before
    learned(tmp_path / "two", workers=2)
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


def test_another_function_or_option_is_another_question(tmp_path):
    learned(tmp_path, count=1)
    before = learned(tmp_path, count=1).rows[0]
    other = learned(tmp_path, count=1, window=0.7).rows[0]
    whole = learn_many(
        {"run 0": Samples(TIMES, -0.3 * np.sin(4 * TIMES) ** 2)}, PLANT, KERNEL, (0.0, 1.0), folder=tmp_path,
        noise_std=0.01, mean=-0.15,
    )  # fmt: skip
    assert len({before.request, other.request, whole.rows[0].request}) == 3
    with pytest.raises(InputError, match=r"call fleet\.reference\('run 0'\)"):
        whole.stream("run 0")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"learn": np.mean}, "learn: expected learn_reference or learn_stream"),
        ({"learn": learn_reference}, "learn_reference takes no option 'window'; learn=learn_stream takes it"),
        ({"windows": 1.0}, "learn_stream takes no option 'windows'$"),
        ({"method": "joint"}, "learn_stream takes no option 'method'; learn=learn_reference takes it"),
    ],
    ids=["another function", "options of the other function", "of none", "of the other one"],
)
def test_wrong_arguments(tmp_path, options, said):
    with pytest.raises(TypeError, match=said):
        learned(tmp_path, **options)


def test_an_option_that_is_lacking(tmp_path):
    with pytest.raises(TypeError, match="learn_stream needs the option 'window'"):
        learn_many({"run": Samples(TIMES, TIMES)}, PLANT, KERNEL, "recorded", folder=tmp_path, learn=learn_stream)
