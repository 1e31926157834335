"""Figs. 2 and 3 of the paper: a reachable tube, and an asymptotically constant reference."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.learning.published.tail import tail
from trackably.plots.scalar import input_at_steps, input_interval, state_at_steps, state_interval, tube_after_steps
from trackably.plots.style import (
    BLUE,
    COLUMN,
    FAINT,
    GREY,
    INK,
    ORANGE,
    PALE,
    SAMPLE,
    direct_label,
    state_bounds,
    step_label,
    styled,
)
from trackably.systems.reference import Reference


@styled
def tube(reference: Reference, steps: Array) -> Figure:
    """Draw a scalar reference at consecutive `steps` k: the states, the tube in reach from each, and the inputs."""
    figure = Figure(figsize=(COLUMN, 3.5))
    states, inputs = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1])
    _fans(states, reference, steps)
    _inputs(inputs, reference, steps)
    states.set_ylabel(r"state $x$ [–]")
    inputs.set_ylabel(r"input $u$ [–]")
    inputs.set_xlabel(step_label(reference.plant.sampling_time))
    inputs.set_xlim(steps[0] - 0.4, steps[-1] + 1.4)
    inputs.xaxis.get_major_locator().set_params(integer=True)
    handles = [handle for axes in (states, inputs) for handle in axes.get_legend_handles_labels()[0]]
    figure.legend(handles=handles, loc="outside upper center", ncols=2)
    figure.align_ylabels()
    return figure


def _fans(axes: Axes, reference: Reference, steps: Array) -> None:
    x, (low, high) = state_at_steps(reference, steps), tube_after_steps(reference, steps)
    fans = [[(k, y), (k + 1, bottom), (k + 1, top)] for k, y, bottom, top in zip(steps, x, low, high, strict=True)]
    ends = [[(k + 1, bottom), (k + 1, top)] for k, bottom, top in zip(steps, low, high, strict=True)]
    axes.add_collection(PolyCollection(fans, facecolors=FAINT, edgecolors="none"))
    label = r"$\mathcal{T}_{k+1}$, in reach from $x_\mathrm{r}(k)$"
    axes.add_collection(LineCollection(ends, colors=GREY, linewidths=1.6, label=label))
    with_next = np.append(steps, steps[-1] + 1)
    x = state_at_steps(reference, with_next)
    axes.plot(with_next, x, color=BLUE, marker="o", linewidth=0.9, label=r"reference $x_\mathrm{r}(k)$")
    axes.autoscale_view()
    state_bounds(axes, state_interval(reference), side="left")


def _inputs(axes: Axes, reference: Reference, steps: Array) -> None:
    bounds, u = input_interval(reference), input_at_steps(reference, steps)
    axes.axhspan(bounds.lower, bounds.upper, facecolor=FAINT, edgecolor="none", label=r"input set $\mathcal{U}$")
    axes.hlines([bounds.lower, bounds.upper], steps[0] - 0.4, steps[-1] + 1.4, colors=INK, linewidths=0.8)
    edges, label = np.append(steps, steps[-1] + 1), r"its input $u_\mathrm{r}(k)$"
    axes.stairs(u, edges, baseline=None, color=BLUE, linewidth=1.2, label=label)
    pad = 0.12 * bounds.width
    axes.set_ylim(bounds.lower - pad, bounds.upper + pad)
    axes.set_yticks([bounds.lower, (bounds.lower + bounds.upper) / 2, bounds.upper])


@styled
def asymptotic(reference: Reference, samples: Samples, transient_step: int, final_step: int, last_step: int) -> Figure:
    """Draw an asymptotically constant scalar reference up to `last_step`, and the bound m ± m̄ where it is decreasing.

    The signal that is sampled varies until `transient_step`; from `final_step` k̄ on the bound lies inside X.
    """
    figure = Figure(figsize=(COLUMN, 2.5))
    axes = figure.subplots()
    plant = reference.plant
    k = np.linspace(0, last_step, 10 * last_step + 1)
    x = state_at_steps(reference, k)
    low, high = float(min(x.min(), samples.values.min())), float(max(x.max(), samples.values.max()))
    bottom, top = low - 0.1 * (high - low), high + 0.4 * (high - low)
    axes.set(xlim=(-1, last_step), ylim=(bottom, top))
    axes.axvspan(0, transient_step, facecolor=PALE, edgecolor="none", zorder=0)
    _envelope(axes, reference, k)
    axes.plot(k, x, color=BLUE, zorder=4, label=r"reference $x_\mathrm{r}$")
    axes.plot(samples.times / plant.sampling_time, samples.values, **SAMPLE)
    axes.axvline(final_step, color=GREY, linewidth=0.8, linestyle=":")
    axes.set(xlabel=step_label(plant.sampling_time), ylabel=r"state $x$ [–]")
    state_bounds(axes, state_interval(reference))
    figure.legend(loc="outside upper center", ncols=3)
    side = "right" if transient_step > last_step / 4 else "left"  # within the grey band if it is wide enough
    direct_label(axes, transient_step, bottom, " transient ", ha=side, va="bottom")
    direct_label(axes, final_step, bottom, rf" $\bar{{k}}$ = {final_step}", va="bottom")
    return figure


def _envelope(axes: Axes, reference: Reference, k: Array) -> None:
    """Draw m ± m̄(t) from where all samples lie further back than ζ, within the limits of the axes."""
    (signal,) = reference.kernel_sums
    tails = [(step, found) for step, t in zip(k, reference.instants(k), strict=True) if (found := tail(signal, t))]
    if not tails:
        return
    steps, reach = np.array([(step, bounds.mean_bound) for step, bounds in tails]).T
    style: dict[str, Any] = {"facecolor": FAINT, "edgecolor": ORANGE, "linestyle": (0, (4, 1.5)), "linewidth": 1.0}
    ends = signal.mean - reach, signal.mean + reach
    axes.fill_between(steps, *ends, zorder=1, label=r"bound $m \pm \bar{m}(t)$", **style)
