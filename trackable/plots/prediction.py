"""The paper's Fig. 5: several references against their bounds and against the published curves."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackable.arrays import Array
from trackable.gp.samples import Samples
from trackable.learning.published.scalar import interval_sets, reachable_tube
from trackable.plots.style import (
    FAINT,
    INK,
    PAGE,
    PALE,
    SAMPLE,
    direct_label,
    reference_looks,
    state_bounds,
    step_label,
    styled,
)
from trackable.systems.reference import Reference

# A panel carries about this many marks of a published curve, so that the line beneath stays visible.
_MARKS: Final = 16
_MARK: Final[dict[str, Any]] = {"linestyle": "none", "color": INK, "markerfacecolor": "white", "markeredgewidth": 0.7}


@dataclass(frozen=True)
class Published:
    """Published curves over steps `k`; the successor set of step k stands at index k."""

    k: Array
    mean_unconstrained: Array
    mean_constrained: Array
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
    """References at consecutive `steps` with the reachable tube of the one named `tube_of`; beside, where one leaves X.

    `true_reference` is the signal behind the samples, at `steps`; `final_step` k̄ is the last constrained step.
    """
    figure = Figure(figsize=(PAGE, 3.3))
    windows = [(float(steps[0] - 0.01 * np.ptp(steps)), float(steps[-1])), *_excursion(references.values(), steps)]
    panels = figure.subplots(1, len(windows), squeeze=False, width_ratios=[1.8, 1][: len(windows)])[0]
    plant = references[tube_of].plant
    state_set, _ = interval_sets(plant)
    for axes, (first, last) in zip(panels, windows, strict=True):
        _curves(axes, references, steps, true_reference)
        reachable(axes, references[tube_of], steps)
        axes.plot(samples.times / plant.sampling_time, samples.values, **SAMPLE)
        if published:
            _published(axes, published, max(1, round((last - first) / _MARKS)))
        if final_step is not None:
            axes.axvline(final_step, color=INK, linewidth=0.8, linestyle=":", zorder=2)
        axes.set(xlabel=step_label(plant.sampling_time), xlim=(first, last))
        if axes is not panels[0]:
            axes.set_ylim(_state_range(references.values(), steps[(steps >= first) & (steps <= last)]))
            axes.set_title(r"where a reference leaves $\mathcal{X}$")
            bottom, top = axes.get_ylim()
            panels[0].indicate_inset((first, bottom, last - first, top - bottom), edgecolor=INK, linewidth=0.6, alpha=1)
        state_bounds(axes, state_set, side="right" if axes is panels[0] else None)
    panels[0].set_ylabel(r"state $x$ [–]")
    if final_step is not None:
        label = rf" $\bar{{k}}$ = {final_step}"
        direct_label(panels[0], final_step, panels[0].get_ylim()[0], label, va="bottom")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(4, ceil(len(labels) / 2)))
    return figure


def _excursion(references: Iterable[Reference], steps: Array) -> list[tuple[float, float]]:
    """From where to where some reference is outside X, and a little more; nothing where that is never, or all over."""
    outside = [interval_sets(r.plant)[0].margin(r.state(steps)[:, 0]) < 0 for r in references]
    leaving = steps[np.any(outside, axis=0)]
    if leaving.size == 0 or np.ptp(leaving) > np.ptp(steps) / 3:
        return []
    around = 2 + np.ptp(leaving) / 4
    return [(float(max(steps[0], leaving[0] - around)), float(min(steps[-1], leaving[-1] + around)))]


def reachable(axes: Axes, reference: Reference, steps: Array) -> None:
    """What each state can reach, one step on: pale; and the part of it inside X: darker."""
    low, high = reachable_tube(reference, reference.instants(steps))
    states, _ = interval_sets(reference.plant)
    inside = np.maximum(low, states.lower), np.minimum(high, states.upper)
    axes.fill_between(steps + 1, low, high, facecolor=FAINT, edgecolor="none", label=r"tube $\mathcal{T}_k$")
    label = r"$\mathcal{T}_k \cap \mathcal{X}$"
    axes.fill_between(steps + 1, *inside, where=inside[0] < inside[1], facecolor=PALE, edgecolor="none", label=label)


def _curves(axes: Axes, references: Mapping[str, Reference], steps: Array, true_reference: Array | None) -> None:
    for looks, reference in zip(reference_looks(references).values(), references.values(), strict=True):
        axes.plot(steps, reference.state(steps)[:, 0], **looks)
    if true_reference is not None:
        axes.plot(steps, true_reference, color=INK, linewidth=0.8, zorder=2.9, label="true reference")


def _published(axes: Axes, published: Published, every: int) -> None:
    some = slice(every // 2, None, every)
    for name, mark in (("unconstrained", "s"), ("constrained", "o")):
        curve = getattr(published, f"mean_{name}")
        axes.plot(published.k[some], curve[some], mark, **_MARK, zorder=4, label=f"published, {name}")
    ends_and_labels = ((published.successor_lower, "published, tube"), (published.successor_upper, None))
    for ends, label in ends_and_labels:
        axes.plot(published.k[some] + 1, ends[some], "_", color=INK, markersize=4, markeredgewidth=0.7, label=label)


def _state_range(references: Iterable[Reference], steps: Array) -> tuple[float, float]:
    x = np.array([r.state(steps) for r in references])
    around = 0.15 * float(np.ptp(x))
    return float(x.min()) - around, float(x.max()) + around
