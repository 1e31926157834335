"""The paper's figures of learned references of scalar systems, asymptotic and periodic."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.drawings.style import DOTTED, PUBLISHED, TRUTH, direct_label, state_bounds, step_label
from pipeline.published.scalar import interval_sets, reachable_tube
from trackably.arrays import Array
from trackably.exports.figures import (
    FAINT,
    INK,
    OUTSIDE,
    PALE,
    SAMPLE,
    legend_above,
    pad_limits,
    panels_of,
    reference_styles,
    with_style,
)
from trackably.gp.samples import Samples
from trackably.systems.intervals import Interval
from trackably.systems.reference import Reference

_MARKERS: Final = 16
"""Number of markers of a published curve in a panel, approximately."""


Closer = tuple[str, float, float]
"""A second panel: its title, and the first and the last step that it shows."""
_BEGINNING: Final[Closer] = ("the first 50 steps", 0, 50)


@with_style
def prediction(
    samples: Samples,
    references: Mapping[str, Reference],
    tube_of: str,
    steps: Array,
    *,
    true_reference: Array | None = None,
    published: Mapping[str, Array] | None = None,
    final_step: int | None = None,
) -> Figure:
    """Draw scalar references by their labels at consecutive `steps`, and the reachable tube of the reference `tube_of`.

    Dots mark steps that need an inadmissible input. `true_reference` has the values of the true signal at `steps`.
    `final_step` k̄ is the last constrained step; if it is None, both bounds of the state are shown. A second panel shows
    the steps around those at which a reference leaves X, or without `final_step` the first ones. `published` are curves
    over the steps `k`: means, and the ends of the tube at k + 1, which is reachable from step k.
    """
    closer = _BEGINNING if final_step is None else _excursion(references.values(), steps)
    windows: list[Closer] = [("", float(steps[0] - 0.01 * np.ptp(steps)), float(steps[-1]))]
    windows += [closer] if closer else []
    figure, (panels,) = panels_of(3.3, 1, len(windows), width_ratios=[1.8, 1][: len(windows)])
    plant, styles = references[tube_of].plant, reference_styles(references)
    X, U = interval_sets(plant)
    for axes, (title, first, last) in zip(panels, windows, strict=True):
        for label, reference in references.items():
            axes.plot(steps, reference.state(steps)[..., 0], **styles[label])
            _mark_inadmissible(axes, reference, steps, U, styles[label]["color"])
        if true_reference is not None:
            axes.plot(steps, true_reference, **TRUTH | {"label": "true reference"})
        _draw_tube(axes, references[tube_of], steps, X)
        axes.plot(samples.times / plant.sampling_time, samples.values, **SAMPLE)
        if published:
            _published(axes, published, max(1, round((last - first) / _MARKERS)))
        if final_step is not None:
            axes.axvline(final_step, color=INK, **DOTTED, zorder=2)
        axes.set(xlabel=step_label(plant.sampling_time), xlim=(first, last), title=title)
        if axes is panels[0] and final_step is None:
            pad_limits(axes, X)
        state_bounds(axes, X, side="right" if axes is panels[0] else None)
    panels[0].set_ylabel(r"state $x$ [–]")
    if closer:
        shown = steps[(steps >= first) & (steps <= last)]
        x = np.array([reference.state(shown)[..., 0] for reference in references.values()])
        bottom, top = x.min() - 0.15 * np.ptp(x), x.max() + 0.15 * np.ptp(x)
        axes.set_ylim(bottom, top)
        rectangle = (first, bottom, last - first, top - bottom)
        panels[0].indicate_inset(rectangle, edgecolor=INK, linewidth=0.6, alpha=1, zorder=4)
    if final_step is not None:
        label = rf" $\bar{{k}}$ = {final_step}"
        direct_label(panels[0], final_step, panels[0].get_ylim()[0], label, va="bottom")
    return legend_above(figure, columns=min(4, ceil(len({*panels[0].get_legend_handles_labels()[1]}) / 2)))


def _excursion(references: Iterable[Reference], steps: Array) -> Closer | None:
    """Return the range of steps at which a reference is outside X, and a few steps around it.

    None if no reference leaves X, or if this range has more than a third of the length of all steps.
    """
    outside = [interval_sets(r.plant)[0].margin(r.state(steps)[..., 0]) < 0 for r in references]
    leaving = steps[np.any(outside, axis=0)]
    if leaving.size == 0 or np.ptp(leaving) > np.ptp(steps) / 3:
        return None
    around = 2 + np.ptp(leaving) / 4
    first, last = max(steps[0], leaving[0] - around), min(steps[-1], leaving[-1] + around)
    return r"where a reference leaves $\mathcal{X}$", float(first), float(last)


def _draw_tube(axes: Axes, reference: Reference, steps: Array, X: Interval) -> None:
    """Draw the reachable tube one step after each of the `steps` in a pale colour, and its part inside X darker."""
    low, high = reachable_tube(reference, reference.instants(steps))
    inside = np.maximum(low, X.lower), np.minimum(high, X.upper)
    axes.fill_between(steps + 1, low, high, facecolor=FAINT, label=r"tube $\mathcal{T}_k$")
    label = r"$\mathcal{T}_k \cap \mathcal{X}$"
    axes.fill_between(steps + 1, *inside, where=inside[0] < inside[1], facecolor=PALE, label=label)


def _published(axes: Axes, published: Mapping[str, Array], every: int) -> None:
    shown = {name: values[every // 2 :: every] for name, values in published.items()}
    for label, marker in (("unconstrained", "s"), ("constrained", "o")):
        axes.plot(shown["k"], shown[f"mean_{label}"], marker, **PUBLISHED, label=f"published, {label}")
    style: dict[str, Any] = {"color": INK, "markersize": 4, "markeredgewidth": 0.7}
    axes.plot(shown["k"] + 1, shown["successor_lower"], "_", **style, label="published, tube")
    axes.plot(shown["k"] + 1, shown["successor_upper"], "_", **style)


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


def _mark_inadmissible(axes: Axes, reference: Reference, steps: Array, U: Interval, color: str) -> None:
    """Draw a dot at each state of a reference from which no admissible input leads to the next state."""
    inadmissible = U.margin(reference.input(steps)[..., 0]) < 0
    if np.any(inadmissible):
        x = reference.state(steps[inadmissible])[..., 0]
        label = "steps that no input makes"
        axes.plot(steps[inadmissible], x, ".", color=color, markersize=4, zorder=3.6, label=label)


@with_style
def growth_intervals(panels: Mapping[str, GrowthIntervals]) -> Figure:
    """Draw derivatives and the growth rates that bound them, constant on intervals, in one panel for each title."""
    figure, (row,) = panels_of(4.0, 1, len(panels), sharey=True)
    for axes, (title, shown) in zip(row, panels.items(), strict=True):
        styles = reference_styles(shown.derivatives)
        axes.fill_between(
            np.repeat(shown.edges, 2)[1:-1],
            np.repeat(shown.lower, 2),
            np.repeat(shown.upper, 2),
            label=r"growth rates $[\underline{\tau}_i, \overline{\tau}_i]$",
            **OUTSIDE,
        )
        for rate in (shown.lower, shown.upper):
            axes.stairs(rate, shown.edges, baseline=None, **_EDGE)
        for name, values in shown.derivatives.items():
            axes.plot(shown.times, values, **styles[name])
        axes.set(title=title, xlabel="time $t$ [s]", xlim=(shown.edges[0], shown.edges[-1]))
    row[0].set_ylabel(r"derivative $\dot{m}^+$ [1/s]")
    return legend_above(figure, columns=3)
