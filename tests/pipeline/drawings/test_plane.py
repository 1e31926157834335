"""Figures in the plane of two states: what is broken is marked, and loops lead to their reference."""

import numpy as np
from matplotlib.figure import Figure

from pipeline.drawings import loops, references
from pipeline.loops.trajectory import LoopTrajectory
from trackably.exports import figures
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.posterior import Posterior
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

PLANT = ConstrainedSystem(
    LinearSystem(np.diag([0.9, 0.8]), np.eye(2), states=("x", "y"), inputs=("u", "w"), sampling_time=0.1),
    Polytope.box([-1.5, -2.0], [0.7, 2.0]),
    Polytope.box([-2.0, -2.0], [2.0, 2.0]),
)
PERIOD = 2.0


def around(height: float) -> Reference:
    """Return a reference on a closed path."""
    t = np.arange(20) / 20 * PERIOD
    waves = np.sin(2 * np.pi * t / PERIOD), height * np.cos(2 * np.pi * t / PERIOD)
    prior = Prior(Periodic(1.0, 1.0, PERIOD), 0.01)
    return Reference(tuple(Posterior(prior, Samples(t, wave)).signal for wave in waves), PLANT)


def draw_path(second: np.ndarray) -> Figure:
    first = np.arange(3.0)
    samples = [Samples(first, np.array([0.0, 0.1, -0.1])), Samples(second, np.array([1.0, 0.9, -1.0]))]
    shown = {"unconstrained": around(1.0), "joint": around(0.4)}
    return references.path(shown, ("x", "y"), np.linspace(0, PERIOD, 101), samples, (first, first))


def draw_loops() -> Figure:
    window = around(0.4).window(0, 30)
    off = window.states + 0.3 * 0.7 ** np.arange(31.0)[:, None]
    steps, inputs = np.arange(31.0), np.zeros((31, 2))
    rest = (window.states, inputs, np.zeros(31), np.zeros(31), np.zeros(31))
    shown = {name: LoopTrajectory(steps, x, inputs, *rest) for name, x in (("on", window.states), ("above", off))}
    return loops.loops_in_plane(shown, PLANT, ("x", "y"), 30)


def lines(figure: Figure) -> dict[str, np.ndarray]:
    (axes,) = figure.axes
    return {str(line.get_label()): np.asarray(line.get_xydata()) for line in axes.lines}


def test_what_the_first_reference_breaks_is_marked_and_nothing_else():
    drawn = lines(draw_path(np.arange(3.0)))
    marked = drawn["x too high (unconstrained)"]
    is_marked = np.isfinite(marked[:, 0])
    assert np.array_equal(is_marked, drawn["unconstrained"][:, 0] > 0.7)
    assert 5 < np.sum(is_marked) < 50
    assert not any("joint)" in label or "too low" in label for label in drawn if label.startswith(("x ", "y ")))


def test_the_path_is_that_of_the_states_in_one_scale():
    figure = draw_path(np.arange(3.0))
    times = np.linspace(0, PERIOD, 101)
    np.testing.assert_array_equal(lines(figure)["joint"], around(0.4).state_at(times))
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()) == ("x", "y", 1.0)


def test_samples_are_points_of_the_plane_only_where_both_were_taken():
    assert "samples" in lines(draw_path(np.arange(3.0)))
    assert "samples" not in lines(draw_path(np.arange(3.0) + 0.5))


def test_loops_end_on_the_reference():
    drawn = lines(draw_loops())
    np.testing.assert_allclose(drawn["from above it"][-1], drawn["reference"][-1], atol=1e-4)
    assert np.max(np.abs(drawn["from above it"][0] - drawn["reference"][0])) > 0.2


def test_drawing_twice_gives_the_same_bytes():
    for draw in (lambda: draw_path(np.arange(3.0)), draw_loops):
        assert figures.svg(draw()) == figures.svg(draw())
