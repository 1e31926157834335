"""The figure of Algorithm 1: its iterations."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.drawings.style import DOTTED, GREY, PUBLISHED, SYMBOLS, direct_label
from pipeline.published.algorithm1 import Trace
from trackably.arrays import Array
from trackably.exports.figures import BLUE, FAINT, INK, PAGE, with_style
from trackably.systems.intervals import Interval

_STEP: Final = r"iteration $\bar{k}$ [steps]"
_LIMIT: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.9, "linestyle": (0, (4, 1.5))}
_RATES: Final = "growth_lower", "growth_upper", "derivative_bound"
_EVERY: Final = 5  # iterations from one marker of a published curve to the next


@with_style
def convergence(
    trace: Trace,
    names: Sequence[str],
    state_set: Interval,
    prior_mean: float,
    published: Mapping[str, Array] | None = None,
) -> Figure:
    """Draw the hyperparameters `names` and bounds at each iteration; mark the first one that passes each test.

    `published` curves have the names of the columns of a trace, and `k_bar` for the iterations; NaN is not drawn.
    """
    count, k_bar = len(names), trace["k_bar"]
    figure = Figure(figsize=(PAGE, max(3.8, 1.3 * count)))
    grid = figure.add_gridspec(2 * count, 2)
    of_parameters = [figure.add_subplot(grid[2 * i : 2 * i + 2, 0]) for i in range(count)]
    mean, rate = figure.add_subplot(grid[:count, 1]), figure.add_subplot(grid[count:, 1])
    for axes, name in zip(of_parameters, names, strict=True):
        axes.plot(k_bar, trace[name], color=BLUE, marker="o", markersize=1.8, linewidth=0.8)
        axes.set_ylabel(SYMBOLS.get(name, name))
    _mean_bound(mean, trace, float(state_set.margin(np.array(prior_mean))))
    _derivative_bound(rate, trace)
    of_bounds = {"mean_bound": mean, **dict.fromkeys(_RATES, rate)}
    for name, axes in {**dict(zip(names, of_parameters, strict=True)), **of_bounds}.items():
        if published and name in published:
            k, values = published["k_bar"][::_EVERY], published[name][::_EVERY]
            axes.plot(k, values, "s", markersize=2.5, **PUBLISHED)
    for axes in (*of_parameters, mean, rate):
        axes.set_xlim(k_bar[0] - 0.5, k_bar[-1] + 0.5)
        axes.set_xlabel(_STEP) if axes in (of_parameters[-1], rate) else axes.tick_params(labelbottom=False)
    figure.align_ylabels()
    return figure


def _mean_bound(axes: Axes, trace: Trace, margin: float) -> None:
    """Draw the bound m̄ and the `margin` of the prior mean to the ends of X; the state test is that m̄ is smaller."""
    axes.plot(trace["k_bar"], trace["mean_bound"], color=BLUE)
    axes.set_ylabel(r"bound $\bar{m}$ on $|m^+ - m|$ [–]")
    axes.set_yscale("log")
    axes.axhline(margin, **_LIMIT)
    direct_label(axes, trace["k_bar"][0], margin, r"room in $\mathcal{X}$", va="bottom")
    _mark(axes, trace, np.isfinite(trace["mean_bound"]), r"$\zeta$-test", "right", (0.1, 1))
    _mark(axes, trace, trace["keeps_states"] > 0, "state test", "right", (0.1, 1))


def _derivative_bound(axes: Axes, trace: Trace) -> None:
    """Draw the derivative bounds ±ṁ̄, and the growth rates between which they have to lie."""
    k, low, high, bound = (trace[name] for name in ("k_bar", *_RATES))
    is_possible = (low < 0) & (high > 0)
    axes.fill_between(k, low, high, where=is_possible, facecolor=FAINT)
    for rate, name, va in ((low, r"$\underline{\tau}$", "top"), (high, r"$\overline{\tau}$", "bottom")):
        axes.plot(k, rate, **_LIMIT)
        if np.isfinite(rate[-1]):
            direct_label(axes, k[-1], rate[-1], name, ha="right", va=va)
    for sign in (1, -1):
        axes.plot(k, sign * bound, color=BLUE)
    if np.any(known := np.isfinite(bound)):
        first, style = np.argmax(known), {"ha": "right", "va": "center", "color": BLUE}
        direct_label(axes, k[first], bound[first], r"$\pm\bar{\dot{m}}$ ", **style)
    axes.set_ylabel("rates [1/s]")
    _mark(axes, trace, is_possible, r"$\underline{\tau} < 0 < \overline{\tau}$", "left", (0.5, 1))
    _mark(axes, trace, trace["keeps_rates"] > 0, "rate test", "left", (0, 0.5))


def _mark(
    axes: Axes, trace: Trace, holds: npt.NDArray[np.bool_], test: str, side: str, span: tuple[float, float]
) -> None:
    """Draw a line at the first iteration at which a test holds, with the name of the test at its outer end."""
    if np.any(holds):
        first = trace["k_bar"][np.argmax(holds)]
        axes.axvline(first, *span, color=GREY, **DOTTED, zorder=1)
        height, va = (1.0, "top") if span[0] > 0 else (0.04, "bottom")
        where = axes.get_xaxis_transform()
        label = f" {test} \n $\\bar{{k}}$ = {first:g} "
        direct_label(axes, first, height, label, ha=side, va=va, transform=where, linespacing=1.5)
