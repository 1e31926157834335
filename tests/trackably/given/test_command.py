"""`python -m trackably certify`: the exit code and one sentence for each answer."""

import json

import numpy as np
import pytest

from tests.trackably.given.test_table import followed
from tests.trackably.plants import AXIS
from trackably.__main__ import main

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


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "system.json").write_text(json.dumps(SYSTEM))
    (tmp_path / "system.yaml").write_text(json.dumps(SYSTEM))
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


def test_times_are_in_the_unit_of_their_heading_and_notes_are_not_read(folder, capsys):
    for unit, step in (("ms", 50), ("sec", 0.05)):
        rows = "".join(f"{step * k:.6g},{x},seen\n" for k, x in enumerate(np.linspace(0, 0.1, 30)))
        (folder / "table.csv").write_text(f"time ({unit}),position [m],note\n{rows}")
        code, text = said(capsys, "table.csv", "--system", "system.json", "--interpolation", "linear")
        assert (code, "proved for all real t from 0 s to 1.45 s" in text) == (0, True)


def test_numbers_in_other_units_are_refused_unless_a_scale_converts_them(folder, capsys):
    table = np.genfromtxt(folder / "table.csv", delimiter=",", skip_header=1)
    table[:, 1] *= 1000
    write(folder / "mm.csv", table, "k,position [mm],velocity [m/s],force")
    code, text = said(capsys, "mm.csv", "--system", "system.json")
    assert code == 2
    assert "mm.csv: column 'position [mm]': the system's file names no units" in text
    assert "--scale position=FACTOR" in text
    for how in ([], ["--interpolation", "cubic"]):
        code, text = said(capsys, "mm.csv", "--system", "system.json", "--scale", "position=1e-3", *how)
        assert (code, text.startswith("proved for ")) == (0, True)
    for wrong, reason in (("x=1", "where NAME is one of position, velocity, force"), ("force=0", "other than zero")):
        code, text = said(capsys, "mm.csv", "--system", "system.json", "--scale", wrong)
        assert (code, text.startswith(f"error: --scale {wrong}: expected "), reason in text) == (2, True, True)


def test_names_may_have_parentheses(folder, capsys):
    system = {**SYSTEM["system"], "states": ["x(1)", "x(2)"]}
    (folder / "system.json").write_text(json.dumps({**SYSTEM, "system": system}))
    rows = (folder / "table.csv").read_text().partition("\n")[2]
    (folder / "table.csv").write_text(f"k,x(1),x(2),force\n{rows}")
    assert said(capsys, "table.csv", "--system", "system.json")[0] == 0


def test_decimal_commas_are_read_if_asked_for(folder, capsys):
    (folder / "comma.csv").write_text((folder / "table.csv").read_text().replace(",", ";").replace(".", ","))
    code, text = said(capsys, "comma.csv", "--system", "system.json")
    assert (code, 'or the option --decimal ",", it would be one' in text) == (2, True)
    code, text = said(capsys, "comma.csv", "--system", "system.json", "--decimal", ",")
    assert (code, text.startswith("proved for the steps 4 to 33")) == (0, True)


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


HEAD = "k,position,velocity,force\n"
STILL = HEAD + "0,0,0,0\n1,0,0,0\n"
UNUSABLE = {
    "a step is left out": (HEAD + "0,0,0,0\n2,0,0,0\n", {}, "bad.csv: line 3: rows must be successive steps"),
    "a word": (HEAD + "0,0,0,0\n1,0,fast,0\n", {}, "bad.csv, line 3, column 'velocity': expected a finite number"),
    "no input": ("k;position;velocity\n0;0;0\n1;0;0\n", {}, "bad.csv: there is no column force"),
    "a column twice": (STILL.replace("velocity", "position [mm]"), {}, "but 'position' is there twice"),
    "an odd unit": (STILL.replace("k,", "t [fortnights],"), {}, "expected a unit of time, one of s, ms"),
    "half a set": (STILL, {"input_set": {"lower": [0]}}, "bad.json: input_set: expected lower with upper"),
    "no JSON": (STILL, None, "bad.json: expected JSON, got "),
    "no file": (None, {}, "bad.csv: there is no such file"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNUSABLE)
def test_what_cannot_be_used(folder, capsys, name):
    table, changed, reason = UNUSABLE[name]
    if table is not None:
        (folder / "bad.csv").write_text(table)
    (folder / "bad.json").write_text("{" if changed is None else json.dumps(SYSTEM | changed))
    code, text = said(capsys, "bad.csv", "--system", "bad.json")
    assert code == 2
    assert reason in text
