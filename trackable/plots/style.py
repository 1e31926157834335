"""How every figure looks, and how it becomes the same bytes each time."""

from collections.abc import Callable, Iterable
from functools import wraps
from io import BytesIO
from itertools import cycle
from pathlib import Path
from typing import Any, Final, ParamSpec

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackable.files import write_atomically
from trackable.systems.sets.interval import Interval

P = ParamSpec("P")

# A user's own matplotlibrc must not show: start from matplotlib's defaults.
SHEETS: Final = ["default", str(Path(__file__).with_name("trackable.mplstyle"))]

# Ticks depend on the size of the axes, and that on the ticks' labels: the second layout starts from the first one.
_LAYOUTS: Final = 2

COLUMN: Final = 3.5
PAGE: Final = 7.0
"""Widths [in]."""

INK, GREY, PALE, FAINT = "#000000", "#666666", "#b8b8b8", "#e3e3e3"
BLUE, GREEN, ORANGE, PURPLE, NAVY = "#0072b2", "#009e73", "#d55e00", "#cc79a7", "#002d4a"

SAMPLE: Final[dict[str, Any]] = {"linestyle": "none", "marker": "x", "color": INK, "zorder": 5, "label": "samples"}
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
)


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw under the project's style, whatever the session's own is, and settle the layout once for all."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.style.context(SHEETS):
            figure = draw(*args, **kwargs)
            for _ in range(_LAYOUTS):
                figure.draw_without_rendering()
            figure.set_layout_engine("none")
            return figure

    return drawn


def reference_looks(names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """The look of each reference, by its position: the same in every figure that names them in the same order."""
    return {name: {**looks, "label": name.replace("_", " ")} for name, looks in zip(names, cycle(_REFERENCES))}


def step_label(sampling_time: float) -> str:
    """An axis of steps says how long one is."""
    return rf"step $k$   ($T_\mathrm{{s}}$ = {sampling_time:g} s)"


def direct_label(axes: Axes, x: float, y: float, text: str, **looks: Any) -> None:
    """A word beside what it names."""
    axes.text(x, y, text, **{"fontsize": 7, "zorder": 6, **looks})


def state_bounds(axes: Axes, states: Interval, side: str | None = "right") -> None:
    """The bounds of X, as far as they lie in the present limits, named at the given side."""
    bottom, top = axes.get_ylim()
    for bound in (states.lower, states.upper):
        if bottom < bound < top:
            axes.axhline(bound, color=INK, linewidth=0.8, zorder=2.5)
            if side:
                _name_bound(axes, bound, side, r"bound of $\mathcal{X}$")


def _name_bound(axes: Axes, y: float, side: str, name: str) -> None:
    looks: dict[str, Any] = {"fontsize": 7, "ha": side, "zorder": 6}
    where = axes.get_yaxis_transform()
    x, indent = (1, -2) if side == "right" else (0, 3)
    axes.annotate(name, (x, y), (indent, 1.5), xycoords=where, textcoords="offset points", **looks)


def svg(figure: Figure) -> bytes:
    """The figure as SVG, letters as paths; equal figures give equal bytes."""
    buffer = BytesIO()
    with matplotlib.style.context(SHEETS):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def save(figure: Figure, path: Path) -> None:
    """Write the figure as SVG. Raises OSError."""
    write_atomically(path, svg(figure))
