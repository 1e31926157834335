"""Sources of samples as params.yaml writes them: files without a header, stamps of messages, what is held out."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.experiments import load_experiment
from pipeline.generate import sampled_by
from tests.pipeline.params import changed, written_to
from tests.trackably.recordings.mcap_files.writers import START, TOPIC, write_plain
from trackably.errors import InputError

LEVEL = """mcap: data/recordings/tank.mcap
        topic: /tank/level
        field: level
        excerpt: {start: 0.0, end: 240.0, held_out: 60.0}"""
FROM = "samples_from: data/recordings/tank.mcap"


def written(folder: Path, source: str, *others: tuple[str, str]) -> Path:
    return written_to(folder, changed("tank", (FROM, f"samples_from: {folder}"), (LEVEL, source), *others))


def times_of(path: Path) -> list[float]:
    return sampled_by(load_experiment("tank", path)).samples[0].times.tolist()


def test_a_file_without_a_header(tmp_path: Path) -> None:
    (tmp_path / "tum.txt").write_text("".join(f"{1305031102 + 0.5 * k} {1 + k / 10} 0\n" for k in range(4)))
    csv = f"csv: {tmp_path}/tum.txt\n        separator: ' '\n        value_column: x\n        columns: [t, x, y]\n"
    stamped = written(tmp_path, f"{csv}        time_column: t\n        time_unit: epoch s")
    assert times_of(stamped) == [0.0, 0.5, 1.0, 1.5]
    counted = written(tmp_path, f"{csv}        time_column: null\n        time_unit: steps")
    assert times_of(counted) == [0.0, 5.0, 10.0, 15.0]


def test_stamps_in_two_columns(tmp_path: Path) -> None:
    rows = [f"01.05.2024;13:00:{k:02};{1 + k / 10}\n" for k in range(0, 20, 5)]
    (tmp_path / "dates.csv").write_text("".join(["Datum;Zeit;x\n", *rows]))
    csv = f"csv: {tmp_path}/dates.csv\n        separator: ';'\n        value_column: x\n"
    stamps = "        time_column: [Datum, Zeit]\n        time_unit: {date_format: '%d.%m.%Y %H:%M:%S'}"
    assert times_of(written(tmp_path, csv + stamps)) == [0.0, 5.0, 10.0, 15.0]


def test_stamps_of_messages(tmp_path: Path) -> None:
    """Log times, publish times and stamps of the writer's messages differ, each by its own way."""
    stamps = [START + 10**9 * k * (k + 1) for k in range(4)]
    messages = [{"level": 1.0, "header": {"stamp": {"sec": s // 10**9, "nanosec": s % 10**9}}, "ms": s // 10**6}
                for s in stamps]  # fmt: skip
    write_plain(tmp_path / "some.mcap", [json.dumps(message).encode() for message in messages])
    mcap = f"mcap: {tmp_path}/some.mcap\n        topic: {TOPIC}\n        field: level\n        time: "
    by = {time: times_of(written(tmp_path, mcap + time))
          for time in ("log", "publish", "{field: header.stamp}", "{field: ms, unit: epoch ms}")}  # fmt: skip
    np.testing.assert_allclose(by["{field: header.stamp}"], [0, 2, 6, 12])
    np.testing.assert_allclose(by["{field: ms, unit: epoch ms}"], [0, 2, 6, 12])
    assert by["log"] != by["{field: header.stamp}"]
    assert times_of(written(tmp_path, mcap.removesuffix("\n        time: "))) == by["log"]


def test_what_is_held_out_has_to_be_there(tmp_path: Path) -> None:
    path = written_to(tmp_path, changed("tank", ("held_out: 60.0", "held_out: 100.0")))
    with pytest.raises(InputError, match=re.escape("excerpt: held_out: expected samples up to ")):
        sampled_by(load_experiment("tank", path))
    with pytest.raises(InputError, match="held_out: expected an end too, as the samples after it are held out"):
        load_experiment("tank", written_to(tmp_path, changed("tank", ("end: 240.0, ", ""))))


def test_an_excerpt_without_an_end_goes_on_to_the_last_sample(tmp_path: Path) -> None:
    ends = ", end: 1e9", ""
    long, endless = (
        times_of(written_to(tmp_path, changed("tank", (", end: 240.0, held_out: 60.0", end)))) for end in ends
    )
    assert long == endless
