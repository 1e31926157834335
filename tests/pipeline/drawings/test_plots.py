"""Figures: the same bytes each time, axes that say what they show, and nothing that needs what may be missing."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path

import matplotlib as mpl
import matplotlib.style
import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.drawings import algorithm1, predictions, style
from pipeline.drawings.style import INITIAL_STATE_STYLES, state_at_steps
from pipeline.loops.initial_states import ABOVE, BELOW, ON
from tests.pipeline.drawings.figures import (
    FIGURES,
    REFERENCES,
    SAMPLES,
    STATE,
    STEPS,
    draw_convergence,
    draw_margins,
    draw_tube,
    trace,
)
from tests.project import ROOT
from trackably.exports import figures
from trackably.exports.figures import SHEETS
from trackably.systems.margins import margin_profile


@cache
def drawn(draw: Callable[[], Figure]) -> Figure:
    return draw()


every_figure = pytest.mark.parametrize("draw", FIGURES, ids=lambda draw: draw.__name__.removeprefix("draw_"))


@cache
def digests_elsewhere() -> dict[str, str]:
    """What the figures are in another process, which orders sets in another way."""
    environment = {**os.environ, "PYTHONHASHSEED": "7"}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "tests.pipeline.drawings.figures"],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, str] = json.loads(done.stdout)
    return found


@every_figure
def test_drawing_twice_gives_the_same_bytes(draw: Callable[[], Figure], tmp_path: Path) -> None:
    style.save(drawn(draw), tmp_path / "once.svg")
    once = (tmp_path / "once.svg").read_bytes()
    assert sha256(once).hexdigest() == digests_elsewhere()[draw.__name__]
    assert once.startswith(b"<?xml")
    assert b"<text" not in once, "letters are paths, so that fonts do not matter"


def test_drawing_and_saving_twice_in_one_process_gives_the_same_bytes() -> None:
    once = figures.svg(drawn(draw_tube))
    assert once == figures.svg(drawn(draw_tube))
    assert once == figures.svg(draw_tube())


@every_figure
def test_every_axis_is_labelled_once(draw: Callable[[], Figure]) -> None:
    """The lowest panel of each column names x, the leftmost panel of each row names y; a unit belongs to each name."""
    axes = drawn(draw).axes
    for at_edge, label in (("is_last_row", "get_xlabel"), ("is_first_col", "get_ylabel")):
        named = [getattr(a, label)() for a in axes if getattr(a.get_subplotspec(), at_edge)()]
        assert named
        assert all("[" in name or "s)" in name or "s$)" in name for name in named), named


@every_figure
def test_nothing_is_cut_off_at_the_edge_of_the_page(draw: Callable[[], Figure]) -> None:
    figure = drawn(draw)
    with matplotlib.style.context(SHEETS):
        used, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert min(used.x0, used.y0, width - used.x1, height - used.y1) > -0.005


@pytest.mark.parametrize("name", REFERENCES)
def test_all_of_a_prediction_is_in_sight(name: str) -> None:
    axes = predictions.prediction(SAMPLES, REFERENCES, name, STEPS).axes[0]
    x = state_at_steps(REFERENCES[name], STEPS)
    bottom, top = axes.get_ylim()
    assert bottom < min(x.min(), SAMPLES.values.min())
    assert max(x.max(), SAMPLES.values.max()) < top
    left, right = axes.get_xlim()
    assert left <= STEPS[0]
    assert right >= STEPS[-1]


@pytest.mark.parametrize("name", REFERENCES)
def test_every_reference_can_be_drawn(name: str) -> None:
    assert algorithm1.tube(REFERENCES[name], np.arange(70, 80)).axes
    assert algorithm1.asymptotic(REFERENCES[name], SAMPLES, 60, 130, 200).axes


def test_a_closer_look_is_taken_only_where_a_reference_leaves_its_state_set() -> None:
    kept = {"sound": REFERENCES["sound"]}
    assert len(predictions.prediction(SAMPLES, kept, "sound", STEPS).axes) == 1
    both = predictions.prediction(SAMPLES, REFERENCES, "sound", STEPS)
    first, last = both.axes[1].get_xlim()
    assert first < 77
    assert last > 105


def test_the_first_step_at_which_each_test_holds_is_named() -> None:
    texts = [text.get_text() for axes in drawn(draw_convergence).axes for text in axes.texts]
    for test, k in ((r"$\zeta$-test", 81), ("rate test", 108), ("state test", 130)):
        assert any(test in text and f"= {k} " in text for text in texts)


def test_published_curves_are_markers_on_ours() -> None:
    """Every fifth point, in the panels of the curves that are published, and nowhere without them."""
    markers = [[line for line in axes.lines if line.get_linestyle() == "None"] for axes in drawn(draw_convergence).axes]
    assert [len(of_panel) for of_panel in markers] == [1, 1, 1, 0]
    for axes, (curve,) in zip(drawn(draw_convergence).axes, markers[:3], strict=False):
        k, values = np.asarray(curve.get_data())
        ours = dict(zip(*np.asarray(axes.lines[0].get_data()), strict=True))
        np.testing.assert_array_equal(values, [ours[step] for step in k])
        assert np.all(np.diff(k) == 5)
    bare = algorithm1.convergence(trace(), STATE.bounds, 0.0)
    assert all(line.get_linestyle() != "None" for axes in bare.axes for line in axes.lines)


def test_a_run_without_any_bounds_can_be_drawn() -> None:
    nothing = np.full(3, np.nan)
    early = replace(
        trace(),
        k_bar=np.arange(70.0, 73.0),
        hyperparameters={"signal_std": np.ones(3), "left.lengthscale": np.ones(3), "noise_std": np.ones(3)},
        mean_bound=nothing,
        growth_lower=nothing,
        growth_upper=nothing,
        derivative_bound=nothing,
        keeps_states=np.zeros(3),
        keeps_rates=np.zeros(3),
    )
    figures.svg(algorithm1.convergence(early, STATE.bounds, 0.0))


def test_the_worst_margins_are_written_out() -> None:
    profile = margin_profile(REFERENCES["unconstrained"], STATE, 150, 5)
    labels = [text.get_text() for axes in drawn(draw_margins).axes for text in axes.get_legend().get_texts()]
    margin, time = profile.worst
    assert any(f"{margin:.3g}".replace("-", "−") in label and f"{time:.4g} s" in label for label in labels)


def test_the_sessions_own_style_neither_shows_nor_changes() -> None:
    expected = figures.svg(drawn(draw_tube))
    with mpl.rc_context({"font.size": 30, "lines.linewidth": 9}):
        assert figures.svg(draw_tube()) == expected
        assert mpl.rcParams["font.size"] == 30


def test_every_initial_state_has_a_style() -> None:
    assert list(INITIAL_STATE_STYLES) == [ON, ABOVE, BELOW]


def test_importing_touches_no_backend() -> None:
    code = "import sys, pipeline.drawings; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
