"""Sets have one grammar; `trackably/given/test_command.py` sees that the command line has the same."""

import numpy as np
import pytest

from trackably.systems.written import set_of

BOX, ROWS = {"lower": [-1, -2], "upper": [1, 2]}, {"rows": [[1, 1], [1, -1]], "lower": [-1, -2], "upper": [3, 4]}
SETS = {
    "a box": BOX,
    "a box with a free coordinate": {"lower": [-1, None], "upper": [1, None]},
    "half-spaces": {"H": [[1, 1], [-1, 0], [0, -1]], "h": [1, 2, 3]},
    "a box and half-spaces": BOX | {"H": [[1, 1]], "h": [1]},
    "rows": ROWS,
}
WRONG = {
    "rows beside H": (ROWS | {"H": [[1, 1]], "h": [1]}, "or rows with lower and upper"),
    "rows alone": ({"rows": [[1, 1]]}, "or rows with lower and upper; got rows"),
    "one end": ({"lower": [-1, -2]}, "expected lower with upper"),
    "a boolean": ({"lower": [True, -2], "upper": [1, 2]}, r"lower\[0\]: expected a number, got True"),
    "uneven lists": ({"H": [[1, 2], [3]], "h": [1]}, r"H: expected numbers, in lists of one length"),
    "a boolean in H beside a box": (BOX | {"H": [[1, True]], "h": [1]}, r"H\[0, 1\]: expected a number, got True"),
    "another name": ({"low": [-1, -2]}, "has an unknown field low"),
    "no set": (5, "expected a mapping of rows, lower, upper, H, h, got 5"),
}


def keeps(written, x):
    """Whether a point keeps each bound that is written."""
    values = np.array(written.get("rows", np.eye(2))) @ x
    lower, upper = (np.array(written.get(end, [None, None]), dtype=float) for end in ("lower", "upper"))
    within = not np.any((values < lower) | (values > upper))  # where there is no bound, it is NaN
    return within and np.all(np.array(written.get("H", [[0, 0]])) @ x <= written.get("h", [0]))


@pytest.mark.parametrize("written", SETS.values(), ids=SETS)
def test_a_set_holds_the_points_that_keep_what_is_written(written):
    points = np.random.default_rng(0).uniform(-6, 6, (400, 2))
    kept = [keeps(written, x) for x in points]
    assert 5 < sum(kept) < 395
    assert (set_of(written).margin(points) >= 0).tolist() == kept


@pytest.mark.parametrize(("written", "why"), WRONG.values(), ids=WRONG)
def test_what_is_no_set_is_refused(written, why):
    with pytest.raises((TypeError, ValueError), match=why):
        set_of(written)
