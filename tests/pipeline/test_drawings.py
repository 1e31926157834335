"""Figures: what they mark and name. That they are the same bytes each time is seen where stages draw all of them."""

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.drawings import algorithm1, references
from pipeline.drawings.style import axis_label, svg
from tests.pipeline.committed import fitted

FITTED = fitted("example1")


def drawn_path() -> Figure:
    found = fitted("vehicle")
    shown = {name: found.learned[name].reference for name in ("unconstrained", "joint")}
    return references.path(shown, ("x", "y"), np.linspace(0, 12, 301), found.sampled.samples, None, {})


def test_what_the_unconstrained_path_breaks_is_marked_and_nothing_else() -> None:
    (axes,) = drawn_path().axes
    lines = {str(line.get_label()): np.asarray(line.get_xydata()) for line in axes.lines}
    marked = [label for label in lines if "unconstrained)" in label]
    assert marked
    for label in marked:
        of_marks = np.isfinite(lines[label][:, 0])
        assert 0 < np.sum(of_marks) < len(of_marks)
    assert not any("joint)" in label for label in lines)
    assert axes.get_aspect() == 1.0


def test_the_sessions_own_style_neither_shows_nor_changes() -> None:
    def drawn() -> bytes:
        return svg(algorithm1.tube(FITTED.learned["sound"].reference, np.arange(12)))

    expected = drawn()
    assert b"<text" not in expected, "letters are paths, so that fonts do not matter"
    with mpl.rc_context({"font.size": 30, "lines.linewidth": 9}):
        assert drawn() == expected
        assert mpl.rcParams["font.size"] == 30


UNITS = {"vx": "m/s", "vy": "m/s", "x": "m", "q[1]": "rad", "flow_in": "m³/s"}
LABELS = {
    "q[1]": "q[1] [rad]",
    "flow_in": "flow in [m³/s]",
    "vx-0.5*vy": "vx-0.5*vy [m/s]",
    "vx (2)": "vx (2) [m/s]",
    "x+vx": "x+vx",
    "z": "z",
}


@pytest.mark.parametrize("name", LABELS)
def test_a_unit_is_written_where_all_terms_have_it(name: str) -> None:
    assert axis_label(name, UNITS) == LABELS[name]
