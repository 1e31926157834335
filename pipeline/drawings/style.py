"""Common parts of figures: markers and labels, panels over time, steps without a plan, scalar systems."""

from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.loops.trajectory import Course, runs_of
from trackably.arrays import Array
from trackably.exports.figures import (
    BLUE,
    BOUND,
    GREEN,
    INK,
    ORANGE,
    PALE,
    svg,
)
from trackably.files import write_atomically
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval

PUBLISHED: Final[dict[str, Any]] = {
    "linestyle": "none",
    "color": INK,
    "markerfacecolor": "white",
    "markeredgewidth": 0.7,
    "zorder": 4,
}
"""Markers for some points of a published curve; they are white inside, so that the line below stays visible."""
SYMBOLS: Final = {
    "signal_std": r"$\theta_1$ [–]",
    "lengthscale": r"$\theta_2$ [s]",
    "period": r"$\theta_3$ [s]",
    "noise_std": r"$\sigma_\mathrm{n}$ [–]",
}
INITIAL_STATE_STYLES: Final[dict[str, dict[str, Any]]] = {
    "on": {"color": GREEN, "linestyle": "-", "linewidth": 2.2, "zorder": 3.0, "label": "from the reference"},
    "above": {"color": ORANGE, "linestyle": (0, (5, 1.4)), "linewidth": 1.2, "zorder": 3.2, "label": "from above it"},
    "below": {"color": BLUE, "linestyle": (0, (1.4, 1)), "linewidth": 1.4, "zorder": 3.3, "label": "from below it"},
}
"""Styles of loops by the names of initial states that `pipeline.loops.trajectory` gives."""
CLOSED_LOOP: Final = INITIAL_STATE_STYLES["on"] | {"label": "closed loop"}
_REFERENCE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.7, "zorder": 3.6, "label": "reference"}
_NO_PLAN: Final[dict[str, Any]] = {
    "facecolor": PALE,
    "alpha": 0.6,
    "zorder": 1,
    "label": "no plan",
}


def step_label(sampling_time: float) -> str:
    """Return the label of an axis of steps, with the length of a step."""
    return rf"step $k$   ($T_\mathrm{{s}}$ = {sampling_time:g} s)"


def direct_label(axes: Axes, x: float, y: float, text: str, **style: Any) -> None:
    """Write a text at the point (x, y), beside the curve that it names."""
    axes.text(x, y, text, **{"fontsize": 7, "zorder": 6, **style})


def state_bounds(axes: Axes, states: Interval, side: str | None = "right") -> None:
    """Draw the bounds of X that lie within the limits of the axes, with labels at the given side; None: no labels."""
    bottom, top = axes.get_ylim()
    for bound in (states.lower, states.upper):
        if bottom < bound < top:
            axes.axhline(bound, **BOUND)
            if side:
                x, indent = (1, -2) if side == "right" else (0, 3)
                style: dict[str, Any] = {"fontsize": 7, "ha": side, "zorder": 6, "textcoords": "offset points"}
                where = axes.get_yaxis_transform()
                axes.annotate(r"bound of $\mathcal{X}$", (x, bound), (indent, 1.5), xycoords=where, **style)


def save(figure: Figure, path: Path) -> None:
    """Write the figure as an SVG file. Raises OSError."""
    write_atomically(path, svg(figure))


def draw_coordinate(axes: Axes, course: Course, name: str, plant: ConstrainedSystem, style: dict[str, Any]) -> None:
    """Draw a state or an input of a loop and of its reference; inputs are constant between steps."""
    drawstyle = "steps-post" if name in plant.system.inputs else "default"
    axes.plot(course.steps, course[name], drawstyle=drawstyle, **style)
    axes.plot(course.steps, course[f"{name}_reference"], drawstyle=drawstyle, **_REFERENCE)


def shade_no_plan(axes: Axes, steps: Array) -> None:
    """Shade the steps without a plan: each run of consecutive `steps`, up to the step after it."""
    for first, last in runs_of(steps):
        axes.axvspan(first, last + 1, **_NO_PLAN)
