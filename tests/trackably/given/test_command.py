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
    (tmp_path / "system.yaml").write_text(json.dumps(SYSTEM))
    return tmp_path


def said(capsys, *arguments):
    code = main(["certify", *arguments])
    found = capsys.readouterr()
    return code, found.out + found.err


def table(heads="k,position,velocity,force", bump=0.0):
    """Return what the axis did, as a file; at the last step the position is off."""
    given = followed(AXIS)
    rows = np.column_stack([np.arange(4, 34), given.states, given.inputs])
    rows[-1, 1] += bump
    return lines(heads, rows)


def lines(heads, rows):
    return "\n".join([heads, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n"


def positions(heads):
    """Return positions at times, with a column that has no name of the system."""
    k = np.arange(30)
    return lines(heads, np.column_stack([0.05 * k, k / 300, k]))


BUMPED, COMMAS = table(bump=0.02), table().replace(",", ";").replace(".", ",")
TOUCHING = lines("k,position,velocity,force", np.array([np.arange(30), np.full(30, 0.2), np.zeros(30), np.zeros(30)]).T)
GERMAN = positions("Zeit [s],position,note")
CUBIC, LINEAR = ["--interpolation", "cubic"], ["--interpolation", "linear"]
ANSWERS = {
    "proved": (table(), [], 0, "proved for the steps 4 to 33"),
    "proved between the steps": (table(), CUBIC, 0, "proved for all real t from 0.2 s to 1.65 s"),
    "refuted": (BUMPED, [], 1, "at step 32 (t = 1.6 s) the system leads to another position"),
    "at a bound": (TOUCHING, [], 0, "proved for the steps 0 to 29"),
    "at a bound between the steps": (TOUCHING, LINEAR, 3, "the margin is smaller than the error of float64 evaluation"),
    "no period": (table(), [*CUBIC, "--claim", "all_phases"], 2, "expected the first value, -0.3, again in"),
    "three rows": ("t,position\n0,0\n.5,0.1\n1,0\n", CUBIC, 0, "proved for all real t from 0 s to 1 s"),
    "one row": ("k,position\n0,0\n", CUBIC, 2, "expected two rows at least, got one"),
    "times": (positions("time,position,note"), LINEAR, 0, "proved for all real t from 0 s to 1.45 s"),
    "times by a heading": (GERMAN, [*LINEAR, "--time", "Zeit [s]"], 0, "proved for all real t from 0 s to 1.45 s"),
    "times in milliseconds": (
        positions("t [ms],position,note"),
        [*LINEAR, "--time", "t [ms]"],
        2,
        "names another unit",
    ),
    "times are missed first": (GERMAN, [], 2, "named t or time or k or step (--time names another one); the columns"),
    "decimal commas": (COMMAS, ["--decimal", ","], 0, "proved for the steps 4 to 33"),
    "in another unit": (table("k,position [mm],velocity,force"), [], 2, "no column position: a table at the steps has"),
    "commas that may be decimal": (COMMAS, [], 2, 'or the option --decimal ",", it would be one'),
}
"""A table, options, and the exit code and a part of the sentence."""


@pytest.mark.parametrize("name", ANSWERS)
def test_each_answer_has_its_code_and_its_sentence_and_the_checker_agrees(folder, capsys, name):
    content, options, code, sentence = ANSWERS[name]
    (folder / "table.csv").write_text(content)
    found, text = said(capsys, "table.csv", "--system", "system.yaml", "--save", "saved.json", *options)
    assert (found, sentence in text) == (code, True)
    if code < 2:
        assert main(["check", "saved.json"]) == (4 if code else 0)


def test_names_may_have_parentheses(folder, capsys):
    system = {**SYSTEM["system"], "states": ["x(1)", "x(2)"]}
    (folder / "system.json").write_text(json.dumps({**SYSTEM, "system": system}))
    (folder / "table.csv").write_text(table("k,x(1),x(2),force"))
    assert said(capsys, "table.csv", "--system", "system.json")[0] == 0


HEAD = "k,position,velocity,force\n"
STILL = HEAD + "0,0,0,0\n1,0,0,0\n"
UNUSABLE = {
    "a step is left out": (HEAD + "0,0,0,0\n2,0,0,0\n", {}, "bad.csv: line 3: rows must be successive steps"),
    "no input": (HEAD + "0,0,0,\n", {}, "inputs: the number at [0, 0] must be finite"),
    "a word": (HEAD + "0,0,0,0\n1,0,fast,0\n", {}, "bad.csv, line 3, column 'velocity': expected a finite number"),
    "a column twice": (STILL.replace("velocity", "position"), {}, "expected one column 'position', got 2"),
    "half a set": (STILL, {"input_set": {"lower": [0]}}, "bad.json: input_set: expected lower with upper"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNUSABLE)
def test_what_cannot_be_used(folder, capsys, name):
    table, changed, reason = UNUSABLE[name]
    (folder / "bad.csv").write_text(table)
    (folder / "bad.json").write_text(json.dumps(SYSTEM | changed))
    code, text = said(capsys, "bad.csv", "--system", "bad.json")
    assert code == 2
    assert reason in text
