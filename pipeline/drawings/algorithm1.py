"""Figures of Algorithm 1: its iterations, the likelihood over the hyperparameters, and illustrations of its ideas."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle, pairwise
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

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
    reference_styles,
    with_style,
)
from trackably.gp.posterior import IllConditioned
from trackably.gp.samples import Samples
from trackably.learning.problem import ConstrainedProblem
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class Landscape:
    """Values over two hyperparameters: l(θ), the negative log marginal likelihood, and the smallest relative margin.

    Values at (`theta1[j]`, `theta2[i]`) have the index [i, j]. A point is feasible if its `margin` is not negative.
    Both values are NaN if K + σ_n² I cannot be factored.
    """

    theta1: Array
    theta2: Array
    objective: Array
    margin: Array


def evaluate_on_grid(problem: ConstrainedProblem, theta1: Array, theta2: Array) -> Landscape:
    """Evaluate a problem on a grid of its two learned hyperparameters."""
    values = np.array([[_at(problem, np.log([first, second])) for first in theta1] for second in theta2])
    return Landscape(theta1, theta2, values[..., 0], values[..., 1])


def _at(problem: ConstrainedProblem, log_theta: Array) -> tuple[float, float]:
    posterior = problem.posterior(log_theta)
    try:
        objective = sum(part.negative_log_likelihood for part in posterior.parts)
    except IllConditioned:
        return np.nan, np.nan
    margins = (constraint.closest(posterior)[1] for constraint in problem.constraints)
    return objective, min((float(np.min(margin)) for margin in margins), default=np.inf)


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


# Contours of l − min l, each about three times the one before.
_LEVELS: Final = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300, 1000, 3000)
_WIDE: Final = 0.3  # part of the panel's width from which on a contour is labelled
_KEYS: Final = (
    Line2D([], [], color=INK, marker=".", markersize=4, linewidth=0.8, label="iterations of Algorithm 1"),
    Patch(facecolor=FAINT, edgecolor=INK, linewidth=1.6, label="all constraints hold"),
    Line2D([], [], color=GREY, linewidth=0.6, label=r"$l(\theta) - \min l$"),
)
# One marker for each reference in their order; they are nested, so that optima that coincide are all visible.
_OPTIMUM_MARKERS: Final[tuple[dict[str, Any], ...]] = (
    {"marker": "D", "markersize": 4.5},
    {"marker": "s", "markersize": 4.5},
    {"marker": "o", "markersize": 8.5, "markerfacecolor": "none", "markeredgewidth": 1.4},
    {"marker": "^", "markersize": 12.5, "markerfacecolor": "none", "markeredgewidth": 1.2},
)


@with_style
def landscape(
    panels: Sequence[Landscape], trace: Trace, names: Sequence[str], references: Mapping[str, Reference]
) -> Figure:
    """Draw objective and feasible set on each grid, the iterations of Algorithm 1, and the optimum of each reference.

    The grids span the two hyperparameters `names`.
    """
    figure, (row,) = panels_of(4.0, 1, len(panels))
    lowest = min(float(np.nanmin(panel.objective)) for panel in panels)
    path = np.array([trace[name] for name in names])
    for axes, panel in zip(row, panels, strict=True):
        axes.set(xscale="log", yscale="log", xlim=panel.theta1[[0, -1]], ylim=panel.theta2[[0, -1]])
        axes.plot(*path, color=INK, marker=".", markersize=4, linewidth=0.8, zorder=4)
        _optima(axes, references, names)
        _contours(axes, panel, lowest)
        axes.set(xlabel=SYMBOLS.get(names[0], names[0]), ylabel=SYMBOLS.get(names[1], names[1]))
        for axis, values in ((axes.xaxis, panel.theta1), (axes.yaxis, panel.theta2)):
            axis.set_major_locator(LogLocator(subs=(1, 2, 5)) if values[-1] > 5 * values[0] else MaxNLocator(5))
            axis.set_minor_locator(NullLocator())
            axis.set_major_formatter("{x:g}")
    _name_ends(axes, path, trace["k_bar"])
    figure.legend(handles=[*axes.get_legend_handles_labels()[0], *_KEYS], loc="outside upper center", ncols=3)
    return figure


def _contours(axes: Axes, panel: Landscape, lowest: float) -> None:
    """Draw contours of l − `lowest`, and shade the feasible set with its boundary.

    Only wide contours are labelled, because labels of narrow ones would cover the markers in them.
    """
    grid = panel.theta1, panel.theta2
    axes.contourf(*grid, panel.margin, levels=[0, np.inf], colors=[FAINT], zorder=1)
    axes.contour(*grid, panel.margin, levels=[0], colors=[INK], linewidths=1.6, zorder=3)
    lines = axes.contour(*grid, panel.objective - lowest, levels=_LEVELS, colors=[GREY], linewidths=0.6, zorder=2)
    least = _WIDE * np.log(panel.theta1[-1] / panel.theta1[0])
    along = [np.log(np.asarray(path.vertices)[:, 0]) for path in lines.get_paths()]
    wide = [level for level, x in zip(lines.levels, along, strict=True) if x.size and np.ptp(x) > least]
    axes.clabel(lines, wide, fontsize=6, fmt="%g")


def _optima(axes: Axes, references: Mapping[str, Reference], names: Sequence[str]) -> None:
    """Mark the learned hyperparameters `names` of each reference."""
    for (name, style), marker in zip(reference_styles(references).items(), cycle(_OPTIMUM_MARKERS)):
        theta = references[name].kernel_sums[0].kernel.hyperparameters
        at = [float(theta[n]) for n in names]
        axes.plot(*at, linestyle="none", color=style["color"], zorder=5, label=f"optimum, {style['label']}", **marker)


def _name_ends(axes: Axes, path: Array, k_bar: Array) -> None:
    """Write k̄ beside the first and the last iteration."""
    style: dict[str, Any] = {
        "fontsize": 7,
        "zorder": 6,
        "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    }
    for i, offset, ha, va in ((0, (-7, 0), "right", "center"), (-1, (0, 9), "center", "bottom")):
        name = rf"$\bar{{k}}$ = {k_bar[i]:g}"
        axes.annotate(name, (path[0, i], path[1, i]), offset, textcoords="offset points", ha=ha, va=va, **style)


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
