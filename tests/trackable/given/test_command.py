"""`python -m trackable certify`: the exit code and one sentence for each answer."""

import json

import numpy as np
import pytest

from tests.trackable.given.test_table import followed
from tests.trackable.plants import AXIS
from trackable.__main__ import main

SYSTEM = {
    "system": {
        "A": [[0, 1], [0, 0]],
        "B": [[0], [1]],
        "continuous": True,
        "sampling_time": 0.05,
        "states": ["position", "velocity"],
        "inputs": ["force"],
    },
    "state_set": {"lower": [-1.1, None], "upper": [0.2, None]},
    "input_set": {"rows": [[1]], "lower": [-2.5], "upper": [2.5]},
}
YAML = """
system: {A: [[0, 1], [0, 0]], B: [[0], [1]], continuous: true, sampling_time: 0.05,
  states: [position, velocity], inputs: [force]}
state_set: {lower: [-1.1, -1.0], upper: [0.2, 1.0]}
input_set: {lower: [-2.5], upper: [2.5]}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "system.json").write_text(json.dumps(SYSTEM))
    (tmp_path / "system.yaml").write_text(YAML)
    table = followed(AXIS)
    rows = np.column_stack([np.arange(4, 34), table.states, table.inputs])
    write(tmp_path / "table.csv", rows)
    rows[10, 1] += 0.02
    write(tmp_path / "bumped.csv", rows)
    return tmp_path


def write(path, rows, heads="k,position [m],velocity,force"):
    path.write_text("\n".join([heads, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n")


def said(capsys, *arguments):
    code = main(["certify", *arguments])
    found = capsys.readouterr()
    return code, found.out + found.err


@pytest.mark.parametrize("system", ["system.json", "system.yaml"])
def test_what_is_proved(folder, capsys, system):
    code, text = said(capsys, "table.csv", "--system", system, "--save", "proof.json")
    assert (code, text.startswith("proved for the steps 4 to 33")) == (0, True)
    assert main(["check", "proof.json"]) == 0
    code, text = said(capsys, "table.csv", "--system", system, "--interpolation", "cubic", "--save", "proof.json")
    assert (code, "proved for all real t from 0.2 s to 1.65 s" in text) == (0, True)
    assert main(["check", "proof.json"]) == 0


def test_what_is_refuted(folder, capsys):
    code, text = said(capsys, "bumped.csv", "--system", "system.yaml", "--save", "table.json")
    assert code == 1
    assert main(["check", "table.json"]) == 4
    assert "REFUTED: at the step k = 14 " in capsys.readouterr().out
    assert "at step 14 (t = 0.7 s) the system leads to another position" in text
    code, text = said(capsys, "bumped.csv", "--system", "system.json", "--interpolation", "cubic", "--save", "no.json")
    assert code == 1
    assert "the force certainly breaks [-2.5, 2.5], by at least" in text
    assert main(["check", "no.json"]) == 4


def test_what_is_undecided(folder, capsys):
    rows = np.column_stack([np.arange(30), np.full(30, 0.2), np.zeros(30), np.zeros(30)])
    write(folder / "touching.csv", rows)
    code, text = said(capsys, "touching.csv", "--system", "system.json", "--interpolation", "linear")
    assert code == 3
    assert "the margin is smaller than the error of float64 evaluation" in text
    assert said(capsys, "touching.csv", "--system", "system.json")[0] == 0, "at the rows the bound is kept, exactly"


@pytest.mark.parametrize(
    ("table", "system", "reason"),
    [
        ("none.csv", "system.json", "there is no such file"),
        ("table.csv", "none.json", "there is no such file"),
        ("table.csv", "table.csv", "table.csv: "),
        ("system.json", "system.json", "expected"),
        ("gap.csv", "system.json", "must be successive steps"),
        ("word.csv", "system.json", "line 3: expected a number, got 'fast'"),
        ("short.csv", "system.json", "line 2: expected 4 cells, got 2"),
        ("lacks.csv", "system.json", "there is no column force"),
        ("timeless.csv", "system.json", "expected a column k or step"),
        ("table.csv", "field.json", "system has no field D"),
        ("table.csv", "set.json", "input_set lacks upper"),
        ("table.csv", "matrix.json", "A must be a square matrix"),
        ("table.csv", "broken.yaml", "is not YAML"),
    ],
)
def test_what_cannot_be_used(folder, capsys, table, system, reason):
    (folder / "gap.csv").write_text("k,position,velocity,force\n0,0,0,0\n2,0,0,0\n")
    (folder / "word.csv").write_text("k,position,velocity,force\n0,0,0,0\n1,0,fast,0\n")
    (folder / "short.csv").write_text("k,position,velocity,force\n0,0\n1,0\n")
    (folder / "lacks.csv").write_text("k;position;velocity\n0;0;0\n1;0;0\n")
    (folder / "timeless.csv").write_text("position,velocity,force\n0,0,0\n1,0,0\n")
    (folder / "field.json").write_text(json.dumps({**SYSTEM, "system": {**SYSTEM["system"], "D": 0}}))
    (folder / "set.json").write_text(json.dumps({**SYSTEM, "input_set": {"lower": [0]}}))
    (folder / "matrix.json").write_text(json.dumps({**SYSTEM, "system": {**SYSTEM["system"], "A": [[1, 0]]}}))
    (folder / "broken.yaml").write_text("system: {A: [[0, 1]")
    code, text = said(capsys, table, "--system", system)
    assert code == 2
    assert reason in text


def test_claims_about_other_times_need_an_interpolation(folder, capsys):
    code, text = said(capsys, "table.csv", "--system", "system.json", "--claim", "all_times")
    assert (code, "needs an --interpolation" in text) == (2, True)
