"""Fleets: what is learned, what is kept, and that nothing depends on who learns it."""

import math
import shutil
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.trackably.fleet.recordings import KERNEL, PLANT, TWO_MOTIONS, contents, learned, motion, unreadable
from trackably import Samples, Source, SquaredExponential, check, learn_reference, learn_stream
from trackably.checker import Proved
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.fleet.learn_many import Request


def written(folder: Path) -> dict[str, int]:
    return {path.parent.name: path.stat().st_mtime_ns for path in folder.rglob("row.json")}


def test_each_reference_is_that_of_learn_reference_and_its_certificate_is_proved(two):
    alone = learn_reference(motion(1), PLANT, KERNEL, "all_times", noise_std=0.01)
    assert [row.name for row in two.rows] == ["run 0", "run 1"]
    assert two.rows[1].fingerprint == alone.fingerprint == two.reference("run 1").fingerprint
    assert isinstance(check(two.folder / "run 1" / "certificate.json"), Proved)


def changed_in(file: str):
    def change(folder: Path) -> None:
        path = folder / "run 0" / file
        path.write_text(path.read_text().replace("1", "2", 1))

    return change


CHANGED = {
    "samples": (lambda _: {"recordings": {**TWO_MOTIONS, "run 0": motion(7)}}, {"run 0"}),
    "an option": (lambda _: {"noise_std": 0.02}, {"run 0", "run 1"}),
    "a reference": (changed_in("reference.json"), {"run 0"}),
    "a row": (changed_in("row.json"), {"run 0"}),
    "a certificate that is gone": (lambda folder: (folder / "run 0" / "certificate.json").unlink(), {"run 0"}),
}


@pytest.mark.parametrize("what", CHANGED)
def test_what_an_answer_depends_on_makes_it_asked_again(tmp_path, two, what):
    change, expected = CHANGED[what]
    shutil.copytree(two.folder, tmp_path, dirs_exist_ok=True)
    before = written(tmp_path)
    options = change(tmp_path) or {}
    learned(options.pop("recordings", TWO_MOTIONS), tmp_path, **options)
    assert {name for name, when in written(tmp_path).items() if when != before[name]} == expected
    assert (contents(tmp_path) == contents(two.folder)) == (what not in ("samples", "an option"))


def test_failures_are_rows_with_their_sentence_and_the_others_go_on(tmp_path):
    def late(measured):
        warnings.warn("late", DoubtfulInputWarning, stacklevel=1)
        return measured

    sources = [
        Source("unreadable", unreadable),
        Source("no samples of it", lambda: {"speed": motion(0)}),
        Source("outside", lambda: late(Samples([0.0, 0.1], [30.0, 30.0]))),
        Source("fine, from a table of pandas", lambda: late(pd.Series(motion(0).values, motion(0).times))),
    ]
    stiff = SquaredExponential(signal_std=1.0, lengthscale=(0.2, 0.3))
    learn = partial(learned, sources, tmp_path, (0.0, 0.1), stiff, method="hyperparameters")
    fleet = learn()
    assert [row.outcome for row in fleet.rows] == ["unusable", "unusable", "infeasible", "proved"]
    assert fleet.rows[0].sentence == "a.csv: there is no such file"
    assert all("late" in row.questions for row in fleet.rows[2:])
    with pytest.raises(InputError, match="outside is infeasible"):
        fleet.reference("outside")
    before = written(tmp_path)
    assert learn().rows == fleet.rows
    assert written(tmp_path) == before


def test_warnings_of_other_packages_reach_the_caller(tmp_path, monkeypatch):
    def learn(*_):
        warnings.warn("theirs", stacklevel=1)
        raise ValueError("no samples")

    monkeypatch.setattr(Request, "learn_from", learn)
    with pytest.warns(UserWarning, match="theirs"):
        assert learned({"run": motion(0)}, tmp_path).rows[0].sentence == "no samples"


def test_certificates_of_waypoints_are_written_too(tmp_path):
    fleet = learned({"run": motion(0)}, tmp_path, at={np.float32(0.3): {"state": -0.1}}, at_tolerance=0.02)
    assert fleet.rows[0].files.keys() == {"certificate.json", "certificate.at1.json", "reference.json"}
    assert isinstance(check(tmp_path / "run" / "certificate.at1.json"), Proved)
    own = tmp_path / "run" / "certificate of mine.json"
    own.touch()
    assert learned({"run": motion(0)}, tmp_path).rows[0].files.keys() == {"certificate.json", "reference.json"}
    assert own.exists(), "no file of the user's is removed"


def test_the_recorded_window_reaches_to_the_steps_around_it(tmp_path):
    """A loop takes the step right after the last sample, and the one right before the first."""
    step = PLANT.sampling_time
    between = Samples(motion(0).times + 0.3 * step, motion(0).values)
    found = learned({"run": between}, tmp_path, "recorded").reference("run")
    last = math.ceil(float(between.times[-1]) / step)
    assert found.state(np.array([0, last])).shape == (2, len(PLANT.system.states))
    with pytest.raises(ValueError, match="outside of what is proved"):
        found.state(last + 1)


def test_a_stream_is_proved_and_loaded(tmp_path):
    times = 0.02 * np.arange(70)
    values = -0.3 * np.sin(4 * times) ** 2 + 0.01 * np.random.default_rng(0).normal(size=70)
    fleet = learned({"run": Samples(times, values)}, tmp_path, "recorded", learn=learn_stream, window=1.0, mean=-0.15)
    assert [(row.outcome, row.method, row.price) for row in fleet.rows] == [("proved", "stream", None)]
    assert fleet.stream("run").fingerprint == fleet.rows[0].fingerprint
    assert isinstance(check(tmp_path / "run" / "certificate.json"), Proved)
