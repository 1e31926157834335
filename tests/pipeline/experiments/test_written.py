"""Systems and sets have one grammar: params.yaml and the command line read the same, and refuse the same."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from pydantic import TypeAdapter

from pipeline.experiments.plants import SetField
from trackably.errors import InputError
from trackably.given.command import read_plant
from trackably.systems.polytopes import Polytope

SYSTEM = {"A": [[1.0, 0.0], [0.0, 1.0]], "B": [[1.0, 0.0], [0.0, 1.0]], "sampling_time": 0.1}
BOX, ROWS = {"lower": [-1, -2], "upper": [1, 2]}, {"rows": [[1, 1], [1, -1]], "lower": [-1, -2], "upper": [3, 4]}
SETS = {
    "a box": (BOX, [[1, 0], [0, 1]], [-1, -2], [1, 2]),
    "a box with a free coordinate": ({"lower": [-1, None], "upper": [1, None]}, [[1, 0]], [-1], [1]),
    "half-spaces": (
        {"H": [[1, 1], [-1, 0], [0, -1]], "h": [1, 2, 3]},
        [[1, 1], [-1, 0], [0, -1]],
        [-5, -4, -3],  # as far as the others let it go
        [1, 2, 3],
    ),
    "a box and half-spaces": (
        BOX | {"H": [[1, 1]], "h": [1]},
        [[1, 0], [0, 1], [1, 1]],
        [-1, -2, -3],
        [1, 2, 1],
    ),
    "rows": (ROWS, ROWS["rows"], ROWS["lower"], ROWS["upper"]),
}
WRONG = {
    "rows beside H": (ROWS | {"H": [[1, 1]], "h": [1]}, "or rows with lower and upper"),
    "rows alone": ({"rows": [[1, 1]]}, "expected rows with lower"),
    "one end": ({"lower": [-1, -2]}, "expected lower with upper"),
    "a boolean": ({"lower": [True, -2], "upper": [1, 2]}, "lower: expected a list of numbers"),
    "another name": ({"low": [-1, -2]}, "has an unknown field low"),
    "no set": (5, "expected a mapping of lower, upper, H, h, rows, got 5"),
}


def by_parameters(written: object) -> Polytope:
    return TypeAdapter(SetField).validate_python(yaml.safe_load(yaml.safe_dump(written)))


def by_command(written: object, path: Path) -> Polytope:
    path.write_text(json.dumps({"system": SYSTEM, "state_set": written, "input_set": None}))
    return read_plant(path).state_set


@pytest.mark.parametrize(("written", "rows", "lower", "upper"), SETS.values(), ids=SETS)
def test_both_read_the_bounds_of_sums_of_coordinates(written, rows, lower, upper, tmp_path):
    for found in (by_parameters(written), by_command(written, tmp_path / "plant.json")):
        for mine, expected in zip((found.rows, found.lower, found.upper), (rows, lower, upper), strict=True):
            np.testing.assert_allclose(mine, expected, rtol=1e-5)


@pytest.mark.parametrize(("written", "why"), WRONG.values(), ids=WRONG)
def test_both_refuse_the_same(written, why, tmp_path):
    with pytest.raises(ValueError, match=why):
        by_parameters(written)
    with pytest.raises(InputError, match=rf"plant\.json: state_set: .*{why}"):
        by_command(written, tmp_path / "plant.json")
