"""Fig. 1 of the paper: from data to a learned reference, and from there to the controller."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.plots.scalar import state_interval
from trackably.plots.style import BLUE, FAINT, GREY, INK, PAGE, SAMPLE, styled
from trackably.systems.reference import Reference

_HEIGHT = 1.7  # in
_PANELS, _BOXES = (0.01, 0.44), (0.325, 0.735, 0.925)  # left ends, and middles, as parts of the width
_WIDTH, _BOTTOM, _TOP = 0.2, 0.2, 0.86
_MIDDLE = (_BOTTOM + _TOP) / 2
_ARROWS = (0.214, 0.277), (0.373, 0.436), (0.644, 0.688), (0.781, 0.893)
_HALF, _BELOW = 0.075, 0.12  # of the height: half a box of one line, and where the state goes back
_ROOM = 0.25  # beyond the bound, of the height of what is drawn


@styled
def scheme(reference: Reference, samples: Samples, times: Array, truth: Array | None) -> Figure:
    """Draw samples (and the `truth`, if known) → reference generator → learned `reference` → controller → plant.

    `times` [s] of shape (n,) are those of both panels; the scheme is about scalar systems.
    """
    figure = Figure(figsize=(PAGE, _HEIGHT))
    figure.set_layout_engine("none")
    learned = reference.state_at(times)[:, 0]
    given, made = (figure.add_axes((left, _BOTTOM, _WIDTH, _TOP - _BOTTOM)) for left in _PANELS)
    given.plot(samples.times, samples.values, **{**SAMPLE, "markersize": 3.5})
    if truth is not None:
        given.plot(times, truth, color=GREY, linestyle=(0, (4, 2)), linewidth=0.9)
    made.plot(times, learned, color=BLUE, linewidth=1.2)
    lowest, bound = float(min(learned.min(), samples.values.min())), state_interval(reference).upper
    for axes, title in ((given, r"data ($\times$)"), (made, r"learned reference $x_\mathrm{r}$")):
        _panel(axes, title, float(times[-1]), lowest, bound)
    for middle, words in zip(_BOXES, ("reference\ngenerator\n(GP)", "controller\n(MPC)", "plant"), strict=True):
        _box(figure, middle, words)
    for start, end in _ARROWS:
        _arrow(figure, (start, _MIDDLE), (end, _MIDDLE))
    controller, plant = _BOXES[1:]
    _arrow(figure, (plant, _MIDDLE - _HALF), (plant, _BELOW), (controller, _BELOW), (controller, _MIDDLE - 1.7 * _HALF))
    figure.text(sum(_ARROWS[3]) / 2, _MIDDLE + 0.04, r"$u(k)$", ha="center", fontsize=8)
    figure.text((plant + controller) / 2, _BELOW + 0.03, r"$x(k)$", ha="center", fontsize=8)
    return figure


def _panel(axes: Axes, title: str, last: float, lowest: float, bound: float) -> None:
    """Shade what lies beyond the bound, and leave of the axes two arrows' worth of lines."""
    room = _ROOM * (bound - lowest)
    axes.axhspan(bound, bound + room, facecolor=FAINT, edgecolor="none")
    axes.axhline(bound, color=INK, linewidth=0.8)
    axes.set_xlim(0, last)
    axes.set_ylim(lowest - 0.4 * room, bound + room)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_title(title, fontsize=8)
    axes.set_xlabel(r"time $t$", fontsize=7, labelpad=2)


def _box(figure: Figure, middle: float, words: str) -> None:
    frame = {"boxstyle": "round,pad=0.45", "facecolor": "white", "edgecolor": INK, "linewidth": 0.9}
    figure.text(middle, _MIDDLE, words, ha="center", va="center", fontsize=8, bbox=frame)


def _arrow(figure: Figure, *corners: tuple[float, float]) -> None:
    """Draw a line through corners, in parts of the figure, with a head at its end."""
    figure.add_artist(
        FancyArrowPatch(
            path=Path(corners),
            transform=figure.transFigure,
            arrowstyle="-|>,head_width=2,head_length=4",
            color=INK,
            linewidth=0.9,
            joinstyle="miter",
        )
    )
