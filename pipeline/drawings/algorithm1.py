"""Figures of Algorithm 1: its iterations, and illustrations of its ideas."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from pipeline.drawings.style import COLUMN, DOTTED, GREY, PUBLISHED, SYMBOLS, direct_label, state_bounds, step_label
from pipeline.published.algorithm1 import Trace, tail
from pipeline.published.scalar import interval_sets, reachable_tube
from trackably.arrays import Array
from trackably.exports.figures import (
    BLUE,
    FAINT,
    INK,
    ORANGE,
    PAGE,
    PALE,
    SAMPLE,
    legend_above,
    panels_of,
    with_style,
)
from trackably.gp.samples import Samples
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference

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


@with_style
def tube(reference: Reference, steps: Array) -> Figure:
    """Draw a scalar reference at consecutive `steps` k: states, the tube reachable from each state, and inputs."""
    figure, [[states], [inputs]] = panels_of(3.5, 2, width=COLUMN, sharex=True, height_ratios=[2.2, 1])
    _fans(states, reference, steps)
    _inputs(inputs, reference, steps)
    states.set_ylabel(r"state $x$ [–]")
    inputs.set_ylabel(r"input $u$ [–]")
    inputs.set_xlabel(step_label(reference.plant.sampling_time))
    inputs.set_xlim(steps[0] - 0.4, steps[-1] + 1.4)
    inputs.xaxis.get_major_locator().set_params(integer=True)
    legend_above(figure, columns=2)
    figure.align_ylabels()
    return figure


def _fans(axes: Axes, reference: Reference, steps: Array) -> None:
    with_next = np.append(steps, steps[-1] + 1)
    x, (low, high) = reference.state(with_next)[..., 0], reachable_tube(reference, reference.instants(steps))
    corners = np.transpose([[steps, x[:-1]], [steps + 1, low], [steps + 1, high]], (2, 0, 1))
    axes.add_collection(PolyCollection(list(corners), facecolors=FAINT))
    label = r"$\mathcal{T}_{k+1}$, in reach from $x_\mathrm{r}(k)$"
    axes.add_collection(LineCollection(list(corners[:, 1:]), colors=GREY, linewidths=1.6, label=label))
    axes.plot(with_next, x, color=BLUE, marker="o", linewidth=0.9, label=r"reference $x_\mathrm{r}(k)$")
    axes.autoscale_view()
    state_bounds(axes, interval_sets(reference.plant)[0], side="left")


def _inputs(axes: Axes, reference: Reference, steps: Array) -> None:
    (_, bounds), u = interval_sets(reference.plant), reference.input(steps)[..., 0]
    axes.axhspan(bounds.lower, bounds.upper, facecolor=FAINT, label=r"input set $\mathcal{U}$")
    axes.hlines([bounds.lower, bounds.upper], steps[0] - 0.4, steps[-1] + 1.4, colors=INK, linewidths=0.8)
    edges, label = np.append(steps, steps[-1] + 1), r"its input $u_\mathrm{r}(k)$"
    axes.stairs(u, edges, baseline=None, color=BLUE, linewidth=1.2, label=label)
    pad = 0.12 * bounds.width
    axes.set_ylim(bounds.lower - pad, bounds.upper + pad)
    axes.set_yticks([bounds.lower, (bounds.lower + bounds.upper) / 2, bounds.upper])


@with_style
def asymptotic(reference: Reference, samples: Samples, transient_step: int, final_step: int, last_step: int) -> Figure:
    """Draw an asymptotically constant scalar reference up to `last_step`, and the bound m ± m̄ where it is decreasing.

    The true signal varies until `transient_step` and is constant afterwards; from `final_step` k̄ on, the bound lies
    inside X.
    """
    figure, [[axes]] = panels_of(2.5, width=COLUMN)
    plant = reference.plant
    k = np.linspace(0, last_step, 10 * last_step + 1)
    x = reference.state(k)[..., 0]
    low, high = float(min(x.min(), samples.values.min())), float(max(x.max(), samples.values.max()))
    bottom, top = low - 0.1 * (high - low), high + 0.4 * (high - low)
    axes.set(xlim=(-1, last_step), ylim=(bottom, top))
    axes.axvspan(0, transient_step, facecolor=PALE, zorder=0)
    _envelope(axes, reference, k)
    axes.plot(k, x, color=BLUE, zorder=4, label=r"reference $x_\mathrm{r}$")
    axes.plot(samples.times / plant.sampling_time, samples.values, **SAMPLE)
    axes.axvline(final_step, color=GREY, **DOTTED)
    axes.set(xlabel=step_label(plant.sampling_time), ylabel=r"state $x$ [–]")
    state_bounds(axes, interval_sets(reference.plant)[0])
    legend_above(figure, columns=3)
    side = "right" if transient_step > last_step / 4 else "left"  # in the grey band if it is wide enough
    direct_label(axes, transient_step, bottom, " transient ", ha=side, va="bottom")
    direct_label(axes, final_step, bottom, rf" $\bar{{k}}$ = {final_step}", va="bottom")
    return figure


def _envelope(axes: Axes, reference: Reference, k: Array) -> None:
    """Draw m ± m̄(t) at times that are later than every sample by more than ζ, within the limits of the axes."""
    (signal,) = reference.kernel_sums
    tails = [(step, found) for step, t in zip(k, reference.instants(k), strict=True) if (found := tail(signal, t))]
    if tails:
        steps, *ends = np.array([(step, bounds.states.lower, bounds.states.upper) for step, bounds in tails]).T
        style: dict[str, Any] = {"facecolor": FAINT, "edgecolor": ORANGE, "linestyle": (0, (4, 1.5)), "linewidth": 1.0}
        axes.fill_between(steps, *ends, zorder=1, label=r"bound $m \pm \bar{m}(t)$", **style)


_ROOM = 0.25  # free height beyond the bound, as a part of the height of the curves
_ARROW: Final[dict[str, Any]] = {"arrowstyle": "-|>", "color": INK, "linewidth": 0.9, "shrinkA": 2, "shrinkB": 2}
_BOX: Final[dict[str, Any]] = {"boxstyle": "round,pad=0.45", "facecolor": "white", "linewidth": 0.9}


@with_style
def scheme(reference: Reference, samples: Samples, times: Array, truth: Array | None) -> Figure:
    """Draw samples (and the `truth`, if known) → reference generator → learned `reference` → controller → plant.

    Both panels with curves show the `times` [s] (n,); the system is scalar.
    """
    figure, [panels] = panels_of(1.7, 1, 5, width_ratios=[2.2, 1.1, 2.2, 1, 0.6], gridspec_kw={"wspace": 0.4})
    given, generator, made, controller, plant = panels
    learned = reference.state_at(times)[:, 0]
    given.plot(samples.times, samples.values, **SAMPLE | {"markersize": 3.5})
    if truth is not None:
        given.plot(times, truth, color=GREY, linestyle=(0, (4, 2)), linewidth=0.9)
    made.plot(times, learned, color=BLUE, linewidth=1.2)
    lowest, bound = float(min(learned.min(), samples.values.min())), interval_sets(reference.plant)[0].upper
    room = _ROOM * (bound - lowest)
    for axes, title in ((given, r"data ($\times$)"), (made, r"learned reference $x_\mathrm{r}$")):
        axes.axhspan(bound, bound + room, facecolor=FAINT)
        axes.axhline(bound, color=INK, linewidth=0.8)
        axes.set(xlim=(0, times[-1]), ylim=(lowest - 0.4 * room, bound + room), xticks=[], yticks=[])
        axes.set_title(title, fontsize=8)
        axes.set_xlabel(r"time $t$", fontsize=7, labelpad=2)
    for axes, words in ((generator, "reference\ngenerator\n(GP)"), (controller, "controller\n(MPC)"), (plant, "plant")):
        axes.set_axis_off()
        direct_label(axes, 0.5, 0.5, words, ha="center", va="center", fontsize=8, bbox=_BOX)
    for left, right in pairwise(panels):
        right.annotate("", (0, 0.5), (1, 0.5), "axes fraction", left.transAxes, arrowprops=_ARROW)
    back = _ARROW | {"connectionstyle": "bar,angle=180,fraction=-0.2"}
    controller.annotate("", (0.5, 0.36), (0.5, 0.43), "axes fraction", plant.transAxes, arrowprops=back)
    direct_label(plant, -1.0, 0.56, r"$u(k)$", ha="center", fontsize=8)
    direct_label(plant, -1.0, 0.24, r"$x(k)$", ha="center", fontsize=8)
    return figure
