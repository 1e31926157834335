"""Sets have one grammar; `trackably/given/test_command.py` sees that the command line has the same."""

import numpy as np
import pytest
import yaml
from pydantic import TypeAdapter

from pipeline.experiments.plants import SetField
from trackably.systems.polytopes import Polytope

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


@pytest.mark.parametrize(("written", "rows", "lower", "upper"), SETS.values(), ids=SETS)
def test_bounds_of_sums_of_coordinates_are_read(written, rows, lower, upper):
    found = by_parameters(written)
    for mine, expected in zip((found.rows, found.lower, found.upper), (rows, lower, upper), strict=True):
        np.testing.assert_allclose(mine, expected, rtol=1e-5)


@pytest.mark.parametrize(("written", "why"), WRONG.values(), ids=WRONG)
def test_what_is_no_set_is_refused(written, why):
    with pytest.raises(ValueError, match=why):
        by_parameters(written)
