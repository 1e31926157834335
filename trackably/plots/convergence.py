"""Fig. 4 of the paper: Algorithm 1, iteration by iteration, and the published curves."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from trackably.arrays import Array
from trackably.learning.learned import Trace
from trackably.plots.style import BLUE, FAINT, GREY, INK, PAGE, PUBLISHED, SYMBOLS, direct_label, styled
from trackably.systems.sets.interval import Interval

_STEP: Final = r"iteration $\bar{k}$ [steps]"
_LIMIT: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.9, "linestyle": (0, (4, 1.5))}
_ZOOMED: Final = 11
_EVERY: Final = 5  # so many iterations from one marker of a published curve to the next


@styled
def convergence(
    trace: Trace, state_set: Interval, prior_mean: float, published: Mapping[str, Array] | None = None
) -> Figure:
    """Draw hyperparameters and bounds at each iteration of Algorithm 1; mark where each of its tests first holds.

    `published` curves have the names of the trace, with `k_bar`; of NaN nothing is drawn.
    """
    count = len(trace.hyperparameters)
    figure = Figure(figsize=(PAGE, max(3.8, 1.3 * count)))
    grid = figure.add_gridspec(2 * count, 2)
    of_parameters = [figure.add_subplot(grid[2 * i : 2 * i + 2, 0]) for i in range(count)]
    mean, rate = figure.add_subplot(grid[:count, 1]), figure.add_subplot(grid[count:, 1])
    for axes, (name, values) in zip(of_parameters, trace.hyperparameters.items(), strict=True):
        axes.plot(trace.k_bar, values, color=BLUE, marker="o", markersize=1.8, linewidth=0.8)
        axes.set_ylabel(SYMBOLS.get(name, name))
    _mean_bound(mean, trace, float(state_set.margin(np.array(prior_mean))))
    _derivative_bound(rate, trace)
    for axes, name in (
        *zip(of_parameters, trace.hyperparameters, strict=True),
        (mean, "mean_bound"),
        *((rate, name) for name in ("growth_lower", "growth_upper", "derivative_bound")),
    ):
        if published and name in published:
            _published(axes, published["k_bar"], published[name])
    for axes in (*of_parameters, mean, rate):
        axes.set_xlim(trace.k_bar[0] - 0.5, trace.k_bar[-1] + 0.5)
        axes.set_xlabel(_STEP) if axes in (of_parameters[-1], rate) else axes.tick_params(labelbottom=False)
    figure.align_ylabels()
    return figure


def _published(axes: Axes, k: Array, values: Array) -> None:
    axes.plot(k[::_EVERY], values[::_EVERY], "s", markersize=2.5, **PUBLISHED)


def _mean_bound(axes: Axes, trace: Trace, margin: float) -> None:
    """Draw m̄ and the `margin` of the prior mean in X: the state test holds where m̄ is smaller."""
    axes.plot(trace.k_bar, trace.mean_bound, color=BLUE)
    axes.set_ylabel(r"bound $\bar{m}$ on $|m^+ - m|$ [–]")
    axes.set_ylim(bottom=0)
    _mark(axes, trace, np.isfinite(trace.mean_bound), r"$\zeta$-test", "right", (0, 1))
    _mark(axes, trace, trace.keeps_states > 0, "state test", "right", (0, 0.3))
    zoom = axes.inset_axes((0.56, 0.42, 0.44, 0.58))
    last = trace.k_bar[-_ZOOMED:]
    zoom.plot(last, trace.mean_bound[-_ZOOMED:], color=BLUE, marker="o", markersize=2)
    zoom.axhline(margin, **_LIMIT)
    zoom.tick_params(labelsize=6)
    zoom.xaxis.set_major_locator(MaxNLocator(3, integer=True))
    zoom.set_xlim(last[0] - 0.5, last[-1] + 0.5)
    zoom.set_ylim(bottom=0)
    direct_label(zoom, last[0], 0.95 * margin, r"room in $\mathcal{X}$", va="top")


def _derivative_bound(axes: Axes, trace: Trace) -> None:
    """Draw ±ṁ̄, and the growth rates between which it has to lie."""
    k, low, high, bound = trace.k_bar, trace.growth_lower, trace.growth_upper, trace.derivative_bound
    is_possible = (low < 0) & (high > 0)
    axes.fill_between(k, low, high, where=is_possible, facecolor=FAINT, edgecolor="none")
    for rate, name, va in ((low, r"$\underline{\tau}$", "top"), (high, r"$\overline{\tau}$", "bottom")):
        axes.plot(k, rate, **_LIMIT)
        _name_last(axes, k, rate, name, va)
    for sign in (1, -1):
        axes.plot(k, sign * bound, color=BLUE)
    _name_first(axes, k, bound, r"$\pm\bar{\dot{m}}$ ")
    axes.set_ylabel("rates [1/s]")
    _mark(axes, trace, is_possible, r"$\underline{\tau} < 0 < \overline{\tau}$", "left", (0.5, 1))
    _mark(axes, trace, trace.keeps_rates > 0, "rate test", "left", (0, 0.5))


def _name_last(axes: Axes, k: Array, values: Array, name: str, va: str) -> None:
    if np.isfinite(values[-1]):
        direct_label(axes, k[-1], values[-1], name, ha="right", va=va)


def _name_first(axes: Axes, k: Array, values: Array, name: str) -> None:
    if np.any(known := np.isfinite(values)):
        first = np.argmax(known)
        direct_label(axes, k[first], values[first], name, ha="right", va="center", color=BLUE)


def _mark(
    axes: Axes, trace: Trace, holds: npt.NDArray[np.bool_], test: str, side: str, span: tuple[float, float]
) -> None:
    """Draw a line at the first iteration at which a test holds, with the name of the test at its outer end."""
    if np.any(holds):
        first = trace.k_bar[np.argmax(holds)]
        axes.axvline(first, *span, color=GREY, linewidth=0.8, linestyle=":", zorder=1)
        height, va = (1.0, "top") if span[0] > 0 else (0.04, "bottom")
        where = axes.get_xaxis_transform()
        label = f" {test} \n $\\bar{{k}}$ = {first:g} "
        direct_label(axes, first, height, label, ha=side, va=va, transform=where, linespacing=1.5)
