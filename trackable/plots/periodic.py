"""The paper's Figs. 6 and 7, and what its program (9) costs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

from trackable.arrays import Array
from trackable.gp.samples import Samples
from trackable.learning.published.scalar import interval_sets
from trackable.learning.study import Conservatism
from trackable.plots.prediction import reachable
from trackable.plots.style import (
    COLUMN,
    FAINT,
    INK,
    PAGE,
    SAMPLE,
    reference_looks,
    state_bounds,
    step_label,
    styled,
)
from trackable.systems.reference import Reference

_SHADE: Final[dict[str, Any]] = {"facecolor": FAINT, "edgecolor": "none", "zorder": 0}
_EDGE: Final[dict[str, Any]] = {"color": INK, "linewidth": 0.7, "zorder": 1}


@dataclass(frozen=True)
class GrowthIntervals:
    """Derivatives [1/s] over times [s] by name, and the growth rates [1/s] of η intervals between `edges` [s]."""

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
    """References at `steps` with the tube of the one named `tube_of`; beside, the first steps, and those which no
    admissible input makes."""
    figure = Figure(figsize=(PAGE, 3.3))
    panels = figure.subplots(1, 2, width_ratios=[1.8, 1])
    plant = references[tube_of].plant
    state_set, _ = interval_sets(plant)
    looks = reference_looks(references)
    for axes, last in zip(panels, (steps[-1], first_steps), strict=True):
        shown = steps[steps <= last]
        reachable(axes, references[tube_of], shown)
        if true_reference is not None:
            axes.plot(shown, true_reference[: len(shown)], color=INK, linewidth=0.8, zorder=2.9, label="true reference")
        for name, reference in references.items():
            axes.plot(shown, reference.state(shown)[:, 0], **looks[name])
        for name, reference in references.items():
            _impossible_steps(axes, reference, shown, looks[name]["color"])
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


def _impossible_steps(axes: Axes, reference: Reference, steps: Array, color: str) -> None:
    """A dot at each state from which no admissible input leads to the next."""
    _, input_set = interval_sets(reference.plant)
    broken = input_set.margin(reference.input(steps)[:, 0]) < 0
    if np.any(broken):
        label = "steps that no input makes"
        axes.plot(
            steps[broken], reference.state(steps[broken])[:, 0], ".", color=color, markersize=4, zorder=3.6, label=label
        )


@styled
def growth_intervals(panels: Mapping[str, GrowthIntervals]) -> Figure:
    """For each titled panel the derivatives, and the growth rates that they should keep to, constant on intervals."""
    figure = Figure(figsize=(PAGE, 4.0))
    for axes, (title, shown) in zip(
        figure.subplots(1, len(panels), sharey=True, squeeze=False)[0], panels.items(), strict=True
    ):
        looks = reference_looks(shown.derivatives)
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
            axes.plot(shown.times, values, **looks[name])
        axes.set(title=title, xlabel="time $t$ [s]", xlim=(shown.edges[0], shown.edges[-1]))
        if axes.get_subplotspec().is_first_col():
            axes.set_ylabel(r"derivative $\dot{m}^+$ [1/s]")
    figure.legend(*_once(figure), loc="outside upper center", ncols=5)
    return figure


def _once(figure: Figure) -> tuple[list[Any], list[str]]:
    """Handles and labels of all panels, each label once."""
    found = {
        label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    return list(found.values()), list(found)


@styled
def conservatism(found: Conservatism, exact: float, unconstrained: float) -> Figure:
    """The optimum of the paper's program (9) over its number of intervals, above that of the exact form."""
    figure = Figure(figsize=(COLUMN, 2.6))
    axes = figure.subplots()
    counts = found.counts
    looks = reference_looks(("unconstrained", "exact", "intervals"))
    axes.plot(counts, found.objectives, color=looks["intervals"]["color"], marker="o", linewidth=1.6, zorder=3)
    axes.set_xscale("log", base=2)
    axes.set_xlim(counts[0] / 1.3, counts[-1] * 1.3)
    for level, method, name in (
        (exact, "exact", "exact form, all phases"),
        (unconstrained, "unconstrained", "unconstrained"),
    ):
        axes.axhline(level, **looks[method] | {"label": None})
        axes.annotate(
            f"{name}: {level:.2f}",
            (0, level),
            (4, 3),
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
    axes.set(xlabel=r"number of intervals $\eta$ [–]", ylabel=r"optimum of $l$ [–]")
    axes.set_ylim(bottom=0, top=1.12 * float(np.max(found.objectives)))
    axes.annotate("program (9)", (counts[0], found.objectives[0]), (-2, -15), textcoords="offset points", fontsize=7)
    return figure
