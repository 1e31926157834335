"""Style of all figures, with reproducible output: equal figures give equal bytes of SVG."""

from collections.abc import Callable, Iterable
from functools import wraps
from io import BytesIO
from itertools import cycle
from pathlib import Path
from typing import Any, Final, ParamSpec

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.files import write_atomically
from trackably.plots.formulas import parsed_once
from trackably.systems.sets.interval import Interval

P = ParamSpec("P")

# Start from matplotlib's defaults, so that a user's own matplotlibrc has no effect.
SHEETS: Final = ["default", str(Path(__file__).with_name("trackably.mplstyle"))]

# Ticks depend on the size of the axes, and the size on the tick labels: a second layout starts from the first one.
_LAYOUTS: Final = 2

COLUMN: Final = 3.5
PAGE: Final = 7.0
"""Widths [in]."""

INK, GREY, PALE, FAINT = "#000000", "#666666", "#b8b8b8", "#e3e3e3"
BLUE, GREEN, ORANGE, PURPLE, NAVY = "#0072b2", "#009e73", "#d55e00", "#cc79a7", "#002d4a"

SAMPLE: Final[dict[str, Any]] = {"linestyle": "none", "marker": "x", "color": INK, "zorder": 5, "label": "samples"}
PUBLISHED: Final[dict[str, Any]] = {
    "linestyle": "none",
    "color": INK,
    "markerfacecolor": "white",
    "markeredgewidth": 0.7,
    "zorder": 4,
}
"""Markers of a published curve, some of its points: the line below them stays visible."""
SYMBOLS: Final = {
    "signal_std": r"$\theta_1$ [–]",
    "lengthscale": r"$\theta_2$ [s]",
    "period": r"$\theta_3$ [s]",
    "noise_std": r"$\sigma_\mathrm{n}$ [–]",
}

# The solid line lies below and is wider: with dark dashes on top both stay visible, in grey too, where two agree.
_REFERENCES: Final[tuple[dict[str, Any], ...]] = (
    {"color": ORANGE, "linestyle": (0, (5, 1.4, 1.2, 1.4)), "linewidth": 1.3, "zorder": 3.2},
    {"color": NAVY, "linestyle": (0, (2.6, 1.6)), "linewidth": 1.3, "zorder": 3.3},
    {"color": GREEN, "linestyle": "-", "linewidth": 2.4, "zorder": 3.0},
    {"color": PURPLE, "linestyle": ":", "linewidth": 1.6, "zorder": 3.4},
    {"color": BLUE, "linestyle": (0, (7, 1.6, 1.2, 1.6, 1.2, 1.6)), "linewidth": 1.2, "zorder": 3.1},
)


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw with the project's style, whatever the style of the session is, and fix the layout."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.style.context(SHEETS), parsed_once():
            figure = draw(*args, **kwargs)
            for _ in range(_LAYOUTS):
                figure.draw_without_rendering()
            figure.set_layout_engine("none")
            return figure

    return drawn


def reference_styles(labels: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Return the style of each reference by its label. The style depends on the position only, so that figures which
    show the same references in the same order draw them alike."""
    return {label: {**style, "label": label.replace("_", " ")} for label, style in zip(labels, cycle(_REFERENCES))}


def step_label(sampling_time: float) -> str:
    """Return the label of an axis of steps, with the length of a step."""
    return rf"step $k$   ($T_\mathrm{{s}}$ = {sampling_time:g} s)"


def direct_label(axes: Axes, x: float, y: float, text: str, **style: Any) -> None:
    """Write a word beside what it names."""
    axes.text(x, y, text, **{"fontsize": 7, "zorder": 6, **style})


def state_bounds(axes: Axes, states: Interval, side: str | None = "right") -> None:
    """Draw the bounds of X that lie within the present limits; name them at the given side, if any."""
    bottom, top = axes.get_ylim()
    for bound in (states.lower, states.upper):
        if bottom < bound < top:
            axes.axhline(bound, color=INK, linewidth=0.8, zorder=2.5)
            if side:
                _name_bound(axes, bound, side, r"bound of $\mathcal{X}$")


def _name_bound(axes: Axes, y: float, side: str, name: str) -> None:
    style: dict[str, Any] = {"fontsize": 7, "ha": side, "zorder": 6}
    where = axes.get_yaxis_transform()
    x, indent = (1, -2) if side == "right" else (0, 3)
    axes.annotate(name, (x, y), (indent, 1.5), xycoords=where, textcoords="offset points", **style)


def legend_above(figure: Figure, columns: int | None = None) -> None:
    """Write one legend for all panels above them, with each label once."""
    found = {
        label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(found.values(), found, loc="outside upper center", ncols=columns or len(found))


def svg(figure: Figure) -> bytes:
    """Return the figure as SVG, with letters as paths. Equal figures give equal bytes."""
    buffer = BytesIO()
    with matplotlib.style.context(SHEETS), parsed_once():
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def save(figure: Figure, path: Path) -> None:
    """Write the figure as an SVG file. Raises OSError."""
    write_atomically(path, svg(figure))
