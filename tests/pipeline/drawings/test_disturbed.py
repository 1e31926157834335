"""Figures of disturbed loops: what they show, and that they do so in the same bytes."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from pipeline.drawings import loops
from pipeline.loops.trajectory import LoopTrajectory, Runs
from tests.trackably.control.tube.instances import LOOPS
from trackably.exports import figures

CART = LOOPS["pushed cart"]
STEPS = np.arange(30.0)
ROOM = np.array([0.1, 0.2, 0.3])


def runs() -> Runs:
    """Runs that swing about the reference, in phase with their number."""
    window = CART.reference.window(0, 30)
    reference = np.column_stack([window.states[:30], window.inputs])
    swings = [reference + 0.8 * ROOM * np.sin(STEPS + r)[:, None] for r in range(4)]
    return Runs(STEPS, np.min(swings, axis=0), np.max(swings, axis=0), np.array(swings[:2]))


def course(high: float, lost: tuple[int, ...] = ()) -> LoopTrajectory:
    window = CART.reference.window(0, 29)
    states, inputs = np.full((30, 2), high), np.zeros((30, 1))
    costs = np.where(np.isin(STEPS, lost), np.nan, 1.0)
    return LoopTrajectory(STEPS, states, inputs, window.states, inputs, costs, costs, costs)


def draw_tube_runs() -> Figure:
    return loops.tube_runs(runs(), 300, CART.reference.window(0, 30), (ROOM, ROOM), CART.plant)


def draw_disturbed_loops() -> Figure:
    shown = {
        "nominal": {"drawn": course(0.5), "greedy": course(1.01, (7, 8)), "constant": course(0.99, (7,))},
        "tube": {"drawn": course(0.5), "greedy": course(0.9), "constant": course(0.8)},
    }
    return loops.disturbed_loops(shown, {"nominal": 7, "tube": None}, CART.plant)


def draw_price_of_room() -> Figure:
    return loops.price_of_room([0.0, 0.5, 1.0], [1.0, 2.0, 5.0], [0.1, 0.2, 0.4], {0.0: "joint", 1.0: "robust"})


@pytest.mark.parametrize("draw", [draw_tube_runs, draw_disturbed_loops, draw_price_of_room])
def test_drawing_twice_gives_the_same_bytes(draw):
    assert figures.svg(draw()) == figures.svg(draw())


def test_the_tube_holds_the_range_of_the_runs_and_every_coordinate_has_its_row():
    figure = draw_tube_runs()
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == ["position", "velocity", "u1"]
    right = figure.axes[1]
    low, high = right.get_ylim()
    assert low < -0.1 < 0.1 < high
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "tube", "range of 300 runs", "reference", "single runs"
    ]  # fmt: skip


def test_the_first_failure_is_named_and_what_never_fails_too():
    figure = draw_disturbed_loops()
    titles = [axes.get_title(loc="left") for axes in figure.axes[:2]]
    assert titles == ["nominal:\nfails at step 7", "tube:\nnever fails"]
    assert [axes.get_ylabel() for axes in figure.axes[::2]] == [
        "smallest margin\nof states / width [–]", "smallest margin\nof inputs / width [–]"
    ]  # fmt: skip
    greedy = next(line for line in figure.axes[0].lines if line.get_label() == "greedy ones")
    assert greedy.get_ydata() == pytest.approx(np.full(30, (1 - 1.01) / 2))


def test_named_sizes_stand_at_their_points_and_in_the_legend():
    figure = draw_price_of_room()
    joint, robust = figure.axes[1].lines[1:]
    assert [*joint.get_xydata()[0], *robust.get_xydata()[0]] == [0.0, 0.1, 1.0, 0.4]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["joint", "robust"]


def test_a_misfit_has_the_unit_of_what_is_sampled():
    drawn = loops.price_of_room([0.0, 1.0], [1.0, 5.0], [0.1, 0.4], {0.0: "joint"}, "mm")
    assert [axes.get_ylabel() for axes in drawn.axes] == [r"price $J - \min l$ [–]", "misfit of the samples [mm]"]
