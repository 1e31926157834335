"""Figs. 6 and 7 of the paper, and the price of its program (8)."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.learning.published.study import Conservatism
from trackably.plots.prediction import draw_tube
from trackably.plots.scalar import input_at_steps, input_interval, state_at_steps, state_interval
from trackably.plots.style import (
    COLUMN,
    FAINT,
    INK,
    PAGE,
    SAMPLE,
    legend_above,
    reference_styles,
    state_bounds,
    step_label,
    styled,
)
from trackably.systems.reference import Reference

_SHADE: Final[dict[str, Any]] = {"facecolor": FAINT, "edgecolor": "none", "zorder": 0}
_EDGE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.7, "zorder": 1}


@dataclass(frozen=True)
class GrowthIntervals:
    """Derivatives [1/s] over `times` [s] by their labels; growth rates [1/s] on the η intervals between `edges` [s].

    `lower` and `upper` have shape (η,), `edges` (η + 1,).
    """

    times: Array
    derivatives: Mapping[str, Array]
    edges: Array
    lower: Array
    upper: Array


@styled
def periodic_prediction(
    samples: Samples,
    references: Mapping[str, Reference],
    tube_of: str,
    steps: Array,
    first_steps: int,
    true_reference: Array | None = None,
) -> Figure:
    """Draw scalar references by their labels at `steps`, and the reachable tube of the one `tube_of` names.

    Dots mark steps that need an inadmissible input. A second panel shows the first `first_steps` steps.
    `true_reference` is the signal that is sampled, at `steps`.
    """
    figure = Figure(figsize=(PAGE, 3.3))
    panels = figure.subplots(1, 2, width_ratios=[1.8, 1])
    plant = references[tube_of].plant
    styles, state_set = reference_styles(references), state_interval(references[tube_of])
    for axes, last in zip(panels, (steps[-1], first_steps), strict=True):
        shown = steps[steps <= last]
        draw_tube(axes, references[tube_of], shown)
        if true_reference is not None:
            axes.plot(shown, true_reference[: len(shown)], color=INK, linewidth=0.8, zorder=2.9, label="true reference")
        for name, reference in references.items():
            axes.plot(shown, state_at_steps(reference, shown), **styles[name])
        for name, reference in references.items():
            _mark_inadmissible(axes, reference, shown, styles[name]["color"])
        inside = samples.times <= last * plant.sampling_time * (1 + 1e-9)
        axes.plot(samples.times[inside] / plant.sampling_time, samples.values[inside], **SAMPLE)
        axes.set(xlabel=step_label(plant.sampling_time), xlim=(-0.01 * last, last))
    whole, beginning = panels
    reach = 1.12 * max(abs(state_set.lower), abs(state_set.upper))
    whole.set_ylim(min(-reach, whole.get_ylim()[0]), max(reach, whole.get_ylim()[1]))
    state_bounds(whole, state_set)
    whole.set_ylabel(r"state $x$ [–]")
    beginning.set_title(f"the first {first_steps} steps")
    bottom, top = beginning.get_ylim()
    window = (0, bottom, first_steps, top - bottom)
    whole.indicate_inset(window, edgecolor=INK, linewidth=0.6, alpha=1, zorder=4)
    handles, labels = whole.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


def _mark_inadmissible(axes: Axes, reference: Reference, steps: Array, color: str) -> None:
    """Draw a dot at each state from which no admissible input leads to the next."""
    inadmissible = input_interval(reference).margin(input_at_steps(reference, steps)) < 0
    if np.any(inadmissible):
        x = state_at_steps(reference, steps[inadmissible])
        label = "steps that no input makes"
        axes.plot(steps[inadmissible], x, ".", color=color, markersize=4, zorder=3.6, label=label)


@styled
def growth_intervals(panels: Mapping[str, GrowthIntervals]) -> Figure:
    """Draw derivatives and the growth rates that bound them, constant on intervals, in one panel for each title."""
    figure = Figure(figsize=(PAGE, 4.0))
    for axes, (title, shown) in zip(
        figure.subplots(1, len(panels), sharey=True, squeeze=False)[0], panels.items(), strict=True
    ):
        styles = reference_styles(shown.derivatives)
        axes.fill_between(
            np.repeat(shown.edges, 2)[1:-1],
            np.repeat(shown.lower, 2),
            np.repeat(shown.upper, 2),
            label=r"growth rates $[\underline{\tau}_i, \overline{\tau}_i]$",
            **_SHADE,
        )
        for rate in (shown.lower, shown.upper):
            axes.stairs(rate, shown.edges, baseline=None, **_EDGE)
        for name, values in shown.derivatives.items():
            axes.plot(shown.times, values, **styles[name])
        axes.set(title=title, xlabel="time $t$ [s]", xlim=(shown.edges[0], shown.edges[-1]))
        if axes.get_subplotspec().is_first_col():
            axes.set_ylabel(r"derivative $\dot{m}^+$ [1/s]")
    legend_above(figure, columns=3)
    return figure


@styled
def conservatism(found: Conservatism, levels: Mapping[str, float]) -> Figure:
    """Draw the optimum of the paper's program (8) over its number of intervals, and the optima of other methods.

    `levels` are these optima by their labels, in the order of the figures that show the methods' references, before
    program (8).
    """
    figure = Figure(figsize=(COLUMN, 2.6))
    axes = figure.subplots()
    counts = found.counts
    *styles, program = reference_styles((*levels, "program (8)")).values()
    axes.plot(counts, found.objectives, color=program["color"], marker="o", linewidth=1.6, zorder=3)
    top = 1.12 * float(np.max(found.objectives))
    axes.set_xscale("log", base=2)
    axes.set_xlim(counts[0] / 1.3, counts[-1] * 1.3)
    for (label, level), style in reversed([*zip(levels.items(), styles, strict=True)]):
        axes.axhline(level, **style | {"label": None})
        crowded = any(0 < other - level < 0.1 * top for other in levels.values())
        axes.annotate(
            f"{label}: {level:.2f}",
            (0, level),
            (4, -9 if crowded else 3),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            fontsize=7,
        )
    for count, value in zip(counts, found.objectives, strict=True):
        axes.annotate(f"{value:.1f}", (count, value), (2, 4), textcoords="offset points", fontsize=6.5)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xticks(counts)
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(xlabel=r"number of intervals $\eta$ [–]", ylabel=r"optimum of $l$ or $J$ [–]")
    axes.set_ylim(bottom=0, top=top)
    axes.annotate("program (8)", (counts[0], found.objectives[0]), (-2, -15), textcoords="offset points", fontsize=7)
    return figure
