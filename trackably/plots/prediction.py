"""Fig. 5 of the paper: references with their bounds, a reachable tube, and the published curves."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import cycle
from math import ceil
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.plots.scalar import state_at_steps, state_interval, tube_after_steps
from trackably.plots.style import (
    FAINT,
    INK,
    PAGE,
    PALE,
    PUBLISHED,
    SAMPLE,
    direct_label,
    reference_styles,
    state_bounds,
    step_label,
    styled,
)
from trackably.systems.reference import Reference

_MARKERS: Final = 16
"""Number of markers of a published curve in a panel, approximately."""


@dataclass(frozen=True)
class Published:
    """Published curves over steps `k`: posterior means by their labels, and the ends of the reachable tube.

    Index k of the ends holds the tube at step k + 1: the states in reach from step k.
    """

    k: Array
    means: Mapping[str, Array]
    successor_lower: Array
    successor_upper: Array


@styled
def prediction(
    samples: Samples,
    references: Mapping[str, Reference],
    tube_of: str,
    steps: Array,
    *,
    true_reference: Array | None = None,
    published: Published | None = None,
    final_step: int | None = None,
) -> Figure:
    """Draw scalar references by their labels at consecutive `steps`, and the reachable tube of the one `tube_of` names.

    A second panel shows where a reference leaves X, if one does for a short time. `true_reference` is the signal that
    is sampled, at `steps`; `final_step` k̄ is the last constrained step.
    """
    figure = Figure(figsize=(PAGE, 3.3))
    windows = [(float(steps[0] - 0.01 * np.ptp(steps)), float(steps[-1])), *_excursion(references.values(), steps)]
    panels = figure.subplots(1, len(windows), squeeze=False, width_ratios=[1.8, 1][: len(windows)])[0]
    plant = references[tube_of].plant
    for axes, (first, last) in zip(panels, windows, strict=True):
        _curves(axes, references, steps, true_reference)
        draw_tube(axes, references[tube_of], steps)
        axes.plot(samples.times / plant.sampling_time, samples.values, **SAMPLE)
        if published:
            _published(axes, published, max(1, round((last - first) / _MARKERS)))
        if final_step is not None:
            axes.axvline(final_step, color=INK, linewidth=0.8, linestyle=":", zorder=2)
        axes.set(xlabel=step_label(plant.sampling_time), xlim=(first, last))
        if axes is not panels[0]:
            axes.set_ylim(_state_range(references.values(), steps[(steps >= first) & (steps <= last)]))
            axes.set_title(r"where a reference leaves $\mathcal{X}$")
            bottom, top = axes.get_ylim()
            panels[0].indicate_inset((first, bottom, last - first, top - bottom), edgecolor=INK, linewidth=0.6, alpha=1)
        state_bounds(axes, state_interval(references[tube_of]), side="right" if axes is panels[0] else None)
    panels[0].set_ylabel(r"state $x$ [–]")
    if final_step is not None:
        label = rf" $\bar{{k}}$ = {final_step}"
        direct_label(panels[0], final_step, panels[0].get_ylim()[0], label, va="bottom")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(4, ceil(len(labels) / 2)))
    return figure


def _excursion(references: Iterable[Reference], steps: Array) -> list[tuple[float, float]]:
    """Return the steps between which a reference is outside X, and a few around; none where that is never or often."""
    outside = [state_interval(r).margin(state_at_steps(r, steps)) < 0 for r in references]
    leaving = steps[np.any(outside, axis=0)]
    if leaving.size == 0 or np.ptp(leaving) > np.ptp(steps) / 3:
        return []
    around = 2 + np.ptp(leaving) / 4
    return [(float(max(steps[0], leaving[0] - around)), float(min(steps[-1], leaving[-1] + around)))]


def draw_tube(axes: Axes, reference: Reference, steps: Array) -> None:
    """Draw the reachable tube one step after each of the `steps`: pale, and the part inside X darker."""
    (low, high), states = tube_after_steps(reference, steps), state_interval(reference)
    inside = np.maximum(low, states.lower), np.minimum(high, states.upper)
    axes.fill_between(steps + 1, low, high, facecolor=FAINT, edgecolor="none", label=r"tube $\mathcal{T}_k$")
    label = r"$\mathcal{T}_k \cap \mathcal{X}$"
    axes.fill_between(steps + 1, *inside, where=inside[0] < inside[1], facecolor=PALE, edgecolor="none", label=label)


def _curves(axes: Axes, references: Mapping[str, Reference], steps: Array, true_reference: Array | None) -> None:
    for style, reference in zip(reference_styles(references).values(), references.values(), strict=True):
        axes.plot(steps, state_at_steps(reference, steps), **style)
    if true_reference is not None:
        axes.plot(steps, true_reference, color=INK, linewidth=0.8, zorder=2.9, label="true reference")


def _published(axes: Axes, published: Published, every: int) -> None:
    some = slice(every // 2, None, every)
    for (label, mean), marker in zip(published.means.items(), cycle("so")):
        axes.plot(published.k[some], mean[some], marker, **PUBLISHED, label=f"published, {label}")
    style: dict[str, Any] = {"color": INK, "markersize": 4, "markeredgewidth": 0.7}
    axes.plot(published.k[some] + 1, published.successor_lower[some], "_", **style, label="published, tube")
    axes.plot(published.k[some] + 1, published.successor_upper[some], "_", **style)


def _state_range(references: Iterable[Reference], steps: Array) -> tuple[float, float]:
    x = np.array([state_at_steps(r, steps) for r in references])
    around = 0.15 * float(np.ptp(x))
    return float(x.min()) - around, float(x.max()) + around
