"""Fleets: what is learned, what is kept, and that nothing depends on who learns it."""

import math
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.trackably.fleet.recordings import KERNEL, PLANT, motion, motions
from trackably import Fleet, Samples, Source, SquaredExponential, check, learn_many, learn_reference
from trackably.checker import Proved
from trackably.errors import InputError


def learned(recordings: Any, folder: Path, **options: Any) -> Fleet:
    return learn_many(recordings, PLANT, KERNEL, "all_times", folder=folder, **{"noise_std": 0.01, **options})


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def written(folder: Path) -> dict[str, int]:
    return {path.parent.name: path.stat().st_mtime_ns for path in folder.rglob("row.json")}


def test_each_reference_is_that_of_learn_reference_and_its_certificate_is_proved(tmp_path):
    fleet = learned(motions(2), tmp_path)
    alone = learn_reference(motion(1), PLANT, KERNEL, "all_times", noise_std=0.01)
    assert [row.name for row in fleet.rows] == ["run 0", "run 1"]
    assert fleet.rows[1].fingerprint == alone.fingerprint == fleet.reference("run 1").fingerprint
    assert fleet.rows[1].objective == alone.objective
    assert isinstance(check(tmp_path / "run 1" / "certificate.json"), Proved)


@pytest.fixture(scope="module")
def by_one_process(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one")
    learned(motions(3), folder)
    return contents(folder)


def test_two_processes_write_the_same_bytes_as_one(tmp_path, by_one_process):
    learned(motions(3), tmp_path, workers=2)
    assert contents(tmp_path) == by_one_process


def test_the_workers_of_a_cluster_write_the_same_bytes(tmp_path, by_one_process):
    from distributed import LocalCluster  # noqa: PLC0415  only here

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        learned(motions(3), tmp_path, cluster=cluster.scheduler_address)
    assert contents(tmp_path) == by_one_process


def test_a_run_that_was_killed_goes_on_and_does_no_work_twice(tmp_path):
    script = f"""
from pathlib import Path
from tests.trackably.fleet.recordings import motions
from tests.trackably.fleet.test_learn_many import learned
learned(motions(6), Path({str(tmp_path / "stopped")!r}))
"""
    run = subprocess.Popen([sys.executable, "-c", script])
    while run.poll() is None and len(written(tmp_path / "stopped")) < 2:
        time.sleep(0.005)
    run.send_signal(signal.SIGKILL)
    run.wait()
    before = written(tmp_path / "stopped")
    assert 2 <= len(before) < 6
    learned(motions(6), tmp_path / "stopped")
    after = written(tmp_path / "stopped")
    assert {name: after[name] for name in before} == before
    learned(motions(6), tmp_path / "whole")
    assert {k: v for k, v in contents(tmp_path / "stopped").items() if not k.endswith(".tmp")} == contents(
        tmp_path / "whole"
    )


@pytest.mark.parametrize("changed", ["samples", "option"])
def test_what_an_answer_depends_on_makes_it_asked_again(tmp_path, changed):
    learned(motions(2), tmp_path)
    before = written(tmp_path)
    recordings, options = motions(2), {}
    if changed == "samples":
        recordings["run 1"] = motion(7)
    else:
        options["noise_std"] = 0.02
    learned(recordings, tmp_path, **options)
    again = {name for name, when in written(tmp_path).items() if when != before[name]}
    assert again == ({"run 1"} if changed == "samples" else {"run 0", "run 1"})


@pytest.mark.parametrize(
    ("file", "harm"), [("reference.json", "changed"), ("certificate.json", "missing"), ("row.json", "changed")]
)
def test_files_that_were_harmed_are_made_again(tmp_path, file, harm):
    learned(motions(2), tmp_path)
    whole = contents(tmp_path)
    path = tmp_path / "run 0" / file
    if harm == "changed":
        path.write_bytes(path.read_bytes().replace(b"1", b"2", 1))
    else:
        path.unlink()
    before = written(tmp_path)
    learned(motions(2), tmp_path)
    assert contents(tmp_path) == whole
    assert written(tmp_path)["run 1"] == before["run 1"]


STIFF = SquaredExponential(signal_std=1.0, lengthscale=(0.2, 0.3))


def broken() -> Samples:
    raise InputError("a.csv: there is no such file")


def test_failures_are_rows_with_their_sentence_and_the_others_go_on(tmp_path):
    sources = [
        Source("unreadable", broken),
        Source("no samples of it", lambda: {"speed": motion(0)}),
        Source("outside", lambda: Samples([0.0, 0.1], [30.0, 30.0])),
        Source("fine", lambda: motion(0)),
    ]
    fleet = learn_many(sources, PLANT, STIFF, (0.0, 0.1), folder=tmp_path, noise_std=0.01, method="hyperparameters")
    assert [row.outcome for row in fleet.rows] == ["unusable", "unusable", "infeasible", "proved"]
    assert fleet.rows[0].sentence == "a.csv: there is no such file"
    assert "speed" in fleet.rows[1].sentence
    assert str(fleet).startswith("1 of 4 references are proved")
    with pytest.raises(InputError, match="outside is infeasible"):
        fleet.reference("outside")
    before = written(tmp_path)
    again = learn_many(sources, PLANT, STIFF, (0.0, 0.1), folder=tmp_path, noise_std=0.01, method="hyperparameters")
    assert again.rows == fleet.rows
    assert written(tmp_path) == before


def test_certificates_of_waypoints_are_written_too(tmp_path):
    fleet = learned({"run": motion(0)}, tmp_path, at={0.3: {"state": -0.1}}, at_tolerance=0.02)
    assert fleet.rows[0].files.keys() == {"certificate.json", "certificate.at1.json", "reference.json"}
    assert isinstance(check(tmp_path / "run" / "certificate.at1.json"), Proved)


def test_the_recorded_window_reaches_to_the_steps_around_it(tmp_path):
    """A loop takes the step right after the last sample, and the one right before the first."""
    step = PLANT.sampling_time
    between = Samples(motion(0).times + 0.3 * step, motion(0).values)
    fleet = learn_many({"run": between}, PLANT, KERNEL, "recorded", folder=tmp_path, noise_std=0.01)
    found = fleet.reference("run")
    last = math.ceil(float(between.times[-1]) / step)
    assert found.state(np.array([0, last])).shape == (2, len(PLANT.system.states))
    with pytest.raises(ValueError, match="outside of what is proved"):
        found.state(last + 1)
