"""Labels of axes: names with their units."""

import pytest

from trackably.exports.figures import axis_label

UNITS = {"vx": "m/s", "vy": "m/s", "x": "m", "q[1]": "rad", "flow_in": "m³/s"}
LABELS = {
    "vx": "vx [m/s]",
    "q[1]": "q[1] [rad]",
    "flow_in": "flow in [m³/s]",
    "vx+vy": "vx+vy [m/s]",
    "vx-0.5*vy": "vx-0.5*vy [m/s]",
    "-vx-vy": "-vx-vy [m/s]",
    "vx (2)": "vx (2) [m/s]",
    "x+vx": "x+vx",
    "x+z": "x+z",
    "z": "z",
}


@pytest.mark.parametrize("name", LABELS)
def test_a_unit_is_written_where_all_terms_have_it(name: str) -> None:
    assert axis_label(name, UNITS) == LABELS[name]


def test_without_units_there_are_names_only() -> None:
    assert [axis_label(name, {}) for name in ("x", "vx+vy")] == ["x", "vx+vy"]
