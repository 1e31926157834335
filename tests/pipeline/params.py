"""Variants of params.yaml: its text with some places of one entry changed."""

import re
from pathlib import Path

import pytest

from pipeline.experiments import Experiment, load_experiment
from tests.project import ROOT
from trackably.arrays import Array
from trackably.errors import InputError

PARAMS = (ROOT / "params.yaml").read_text(encoding="utf-8")


def changed(entry: str, *changes: tuple[str, str], text: str = PARAMS) -> str:
    """Return an entry with its replacements, each of what stands there exactly once; others take time to read."""
    block = _entry(entry, text)
    for old, new in changes:
        assert block.count(old) == 1, f"{entry}: {old!r} stands there {block.count(old)} times"
        block = block.replace(old, new)
    return f"experiments:\n{block}"


def _entry(entry: str, text: str) -> str:
    found = re.search(rf"^  {entry}:\n(?:(?:    .*)?\n)*", text, re.MULTILINE)
    assert found, entry
    return found[0]


def undisturbed(entry: str, text: str = PARAMS) -> str:
    """Leave the disturbance of one entry out, and with it the robust method."""
    (block,) = re.findall(r"    disturbance:.*\n(?:      .*\n)+", _entry(entry, text))
    return changed(entry, (block, ""), (", robust]", "]"), text=text)


def written_to(folder: Path, text: str) -> Path:
    """Write params.yaml into a folder and return its path."""
    path = folder / "params.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def refusal(name: str, folder: Path, text: str) -> str:
    """Return the one sentence with which an experiment of this text is refused, after the name of the file."""
    path = written_to(folder, text)
    with pytest.raises(InputError) as raised:
        load_experiment(name, path)
    said = str(raised.value)
    assert said.startswith(f"{path}: ")
    assert "\n" not in said
    return said.removeprefix(f"{path}: ")


def recorded(folder: Path, times: Array, levels: Array, line: str = "") -> Experiment:
    """Return the tank with these samples of its level [m], and a line of its own."""
    rows = "".join(f"{t!r},{level!r}\n" for t, level in zip(times.tolist(), levels.tolist(), strict=True))
    (folder / "tank.csv").write_text(f"t,x\n{rows}", encoding="utf-8")
    entry = changed(
        "tank",
        ("claim: all_times\n", f"claim: all_times\n    {line}\n"),
        ("samples_from: data/recordings/tank.mcap", f"samples_from: {folder}"),
        ("mcap: data/recordings/tank.mcap", f"csv: {folder / 'tank.csv'}"),
        ("topic: /tank/level", "time_column: t\n        time_unit: s"),
        ("field: level", "value_column: x"),
        ("{start: 0.0, end: 240.0, held_out: 60.0}", "{end: 3000.0}"),
    )
    return load_experiment("tank", written_to(folder, entry))


EXAMPLE1 = changed(
    "example1",
    ("algorithm1: {first_step: 70", "algorithm1: {first_step: 128"),
    ("tightness: [0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005]", "tightness: [0.002]"),
    ("      steps: 2000\n", "      steps: 200\n      shown: 30\n"),
    ("steps: {first: 70, last: 120, every: 10}", "steps: {first: 70, last: 80, every: 10}"),
    ("sizes: [0.5, 1.5, 1.9, 2.0]", "sizes: [0.5]"),
)
"""Example 1, begun at k̄ = 128 to save time: the optimum is the same."""
