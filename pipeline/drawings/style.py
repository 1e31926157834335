"""Common parts of figures: markers and labels, the bounds of scalar systems, and SVG.

Equal figures give equal bytes of SVG.
"""

import re
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.exports.figures import BOUND, INK, SHEETS, plain_label
from trackably.files import write_atomically
from trackably.systems.intervals import Interval

COLUMN: Final = 3.5
"""Width [in] of a figure that spans a column."""
GREY: Final = "#666666"
TRUTH: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.8, "zorder": 2.9, "label": "true signal"}
DOTTED: Final[dict[str, Any]] = {"linewidth": 0.8, "linestyle": ":"}
Units = Mapping[str, str]
"""Units by the names of states and inputs."""
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


def axis_label(name: str, units: Units) -> str:
    """Return the label of an axis: the name of a state, an input or a sum, with its unit if it is known.

    A sum has a unit if all of its terms have the same one.
    """
    summed = re.sub(r" \(\d+\)$", "", name)  # equal names are numbered
    terms = [summed] if summed in units else [term for term in re.split("[+*-]", summed) if not term[:1].isdigit()]
    found = {units.get(term) for term in terms if term}
    unit = found.pop() if len(found) == 1 else None
    return plain_label(name) + (f" [{unit}]" if unit else "")


def svg(figure: Figure) -> bytes:
    """Return the figure as SVG, with letters as paths. Equal figures give equal bytes."""
    buffer = BytesIO()
    with matplotlib.style.context([*SHEETS, {"figure.constrained_layout.use": False}]):
        figure.set_layout_engine(None)  # the layout is fixed: one that does nothing would have the figure drawn twice
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def save(figure: Figure, path: Path) -> None:
    """Write the figure as an SVG file. Raises OSError."""
    write_atomically(path, svg(figure))
