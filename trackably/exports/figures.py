"""States and inputs of references over time, between their bounds; and the style of all figures."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import wraps
from itertools import cycle
from pathlib import Path
from typing import Any, Final, ParamSpec

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference

P = ParamSpec("P")
# Start from matplotlib's defaults, so that a user's own matplotlibrc has no effect.
SHEETS: Final = ["default", str(Path(__file__).with_name("trackably.mplstyle"))]
# Ticks depend on the size of the axes, and this size on the tick labels, so the layout is computed twice.
_LAYOUTS: Final = 2
PAGE: Final = 7.0
"""Width [in] of a figure that spans a page."""
INK, PALE, FAINT = "#000000", "#b8b8b8", "#e3e3e3"
BLUE, GREEN, ORANGE, PURPLE, NAVY = "#0072b2", "#009e73", "#d55e00", "#cc79a7", "#002d4a"
SAMPLE: Final[dict[str, Any]] = {"linestyle": "none", "marker": "x", "color": INK, "zorder": 5, "label": "samples"}
BOUND: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.8, "zorder": 2.5}
OUTSIDE: Final[dict[str, Any]] = {"facecolor": FAINT, "zorder": 0}
"""Lines at bounds, and the area outside of them."""
# If two references coincide, both stay visible, also in grey: the solid line is wider and lies below dark dashes.
_REFERENCES: Final[tuple[dict[str, Any], ...]] = (
    {"color": ORANGE, "linestyle": (0, (5, 1.4, 1.2, 1.4)), "linewidth": 1.3, "zorder": 3.2},
    {"color": NAVY, "linestyle": (0, (2.6, 1.6)), "linewidth": 1.3, "zorder": 3.3},
    {"color": GREEN, "linestyle": "-", "linewidth": 2.4, "zorder": 3.0},
    {"color": PURPLE, "linestyle": ":", "linewidth": 1.6, "zorder": 3.4},
    {"color": BLUE, "linestyle": (0, (7, 1.6, 1.2, 1.6, 1.2, 1.6)), "linewidth": 1.2, "zorder": 3.1},
)
_TIMES_OF_BOUNDS: Final = 801  # a bound that moves is drawn at this many times
_PADDING: Final = 0.12  # a panel shows this much beyond its bounds on either side, relative to their distance


def with_style(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Return `draw` as a function that uses the project's style, whatever the session's style, and fixes the layout."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.style.context(SHEETS):
            figure = draw(*args, **kwargs)
            if layout := figure.get_layout_engine():
                for _ in range(_LAYOUTS):
                    layout.execute(figure)
            figure.set_layout_engine("none")
            return figure

    return drawn


@dataclass(frozen=True)
class Observed:
    """Data of a state: the `samples` that it is learned from, and a `band` in which the true signal lies.

    The band has lower and upper values, which are NaN where nothing is known.
    """

    samples: Samples | None = None
    band: tuple[Array, Array] | None = None

    def draw(self, axes: Axes, times: Array) -> None:
        """Draw the data in a panel that shows the `times` [s]."""
        if self.band is not None:
            axes.fill_between(times, *self.band, color=PALE, linewidth=0, alpha=0.7, zorder=2.6, label="true signal")
        if self.samples is not None:
            style = SAMPLE | {"markersize": 3} | ({"label": "centres"} if self.samples.scatters else {})
            axes.plot(self.samples.times, self.samples.values, **style)


def plain_label(name: str) -> str:
    """Return the label of an axis or of a curve: the name of a state, an input, a sum or a reference."""
    return name.replace("_", " ")


@with_style
def tracking(
    references: Mapping[str, Reference],
    observed: Mapping[str, Observed],
    times: Array,
    label: Callable[[str], str] = plain_label,
) -> Figure:
    """Draw each state and input of `references`, by label, at `times` [s], with its `observed` data and its own bounds.

    `label` returns the label of the axis of a state or an input, such as its name with a unit. Values far outside the
    bounds are cut off, and angles do not jump by whole turns. Bounds of sums of several states or inputs are not drawn.
    """
    plant = next(iter(references.values())).plant
    names, bounds = plant.names, bounds_of(plant)
    figure, panels = panels_of(0.7 + 1.25 * len(names), len(names), sharex=True)
    styles = reference_styles(references)
    curves = {
        called: np.hstack([plant.unwrap(of.state_at(times)), of.input_at(times)]) for called, of in references.items()
    }
    for i, (axes, name) in enumerate(zip(panels[:, 0], names, strict=True)):
        for called, values in curves.items():
            axes.plot(times, values[:, i], **styles[called])
        observed.get(name, Observed()).draw(axes, times)
        if name in bounds:
            pad_limits(axes, bounds[name])
            shade_outside(axes, bounds[name])
        axes.set_ylabel(label(name))
        axes.yaxis.set_label_coords(-0.075, 0.5)  # aligned, whatever the width of the tick labels
    axes.set(xlabel="time $t$ [s]", xlim=(times[0], times[-1]))
    return legend_above(figure, columns=5)


def bounds_of(plant: ConstrainedSystem) -> dict[str, Interval]:
    """Return the bounds of a plant by the name of the bounded quantity."""
    return {c.name: c.bounds for c in plant.given_constraints}


def pad_limits(axes: Axes, shown: Interval) -> None:
    """Make the panel show an interval with some padding."""
    shown = shown.hull
    padding = _PADDING * shown.width
    axes.set_ylim(shown.lower - padding, shown.upper + padding)


def shade_outside(axes: Axes, bounds: Interval | None) -> None:
    """Draw each bound within the panel's limits as a line, and shade the area outside."""
    if bounds is None:
        return
    bottom, top = axes.get_ylim()
    if len(bounds.breakpoints):
        left, right = axes.get_xlim()
        times = np.linspace(left, right, _TIMES_OF_BOUNDS)
        jumps = bounds.breakpoints_in(left, right)
        times = np.unique(np.concatenate([times, *(np.nextafter(jumps, end) for end in (-np.inf, np.inf))]))
        for moving, end in zip(bounds.ends(times), (bottom, top), strict=True):
            level = np.clip(np.broadcast_to(moving, times.shape), bottom, top)
            axes.plot(times, level, **BOUND)
            axes.fill_between(times, level, end, **OUTSIDE)
        axes.set(xlim=(left, right), ylim=(bottom, top))
        return
    for bound, end in ((bounds.lower, bottom), (bounds.upper, top)):
        if bottom < bound < top:
            axes.axhline(bound, **BOUND)
            axes.axhspan(*sorted((bound, end)), **OUTSIDE)


def reference_styles(labels: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return the style of each reference by its label.

    It depends on the position only: figures that show the same references in the same order draw them alike.
    """
    return {label: {**style, "label": plain_label(label)} for label, style in zip(labels, cycle(_REFERENCES))}


def panels_of(
    height: float, rows: int = 1, columns: int = 1, width: float = PAGE, **shared: Any
) -> tuple[Figure, NDArray[Any]]:
    """Return a figure of this size [in] and its panels (rows, columns); `shared` is as in `Figure.subplots`."""
    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, squeeze=False, **shared)


def legend_above(figure: Figure, columns: int | None = None) -> Figure:
    """Draw one legend above all panels, with each label once, and return the figure."""
    found = {
        label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(found.values(), found, loc="outside upper center", ncols=columns or len(found))
    return figure
