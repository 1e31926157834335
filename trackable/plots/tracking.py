"""References of systems with several states and inputs: each over time, between its bounds."""

from collections.abc import Mapping
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackable.arrays import Array
from trackable.gp.samples import Samples
from trackable.plots.style import FAINT, GREY, INK, PAGE, SAMPLE, reference_looks, styled
from trackable.systems.reference import Reference
from trackable.systems.sets.interval import Interval


@dataclass(frozen=True)
class Observed:
    """What is known of a state: `samples` it is learned from, those `held_out`, the true signal at `times` [s]."""

    samples: Samples | None = None
    held_out: Samples | None = None
    truth: Array | None = None


@styled
def tracking(references: Mapping[str, Reference], observed: Mapping[str, Observed], times: Array) -> Figure:
    """Every state and every input at `times` [s], with what is known of it, between the bounds that it has alone."""
    plant = next(iter(references.values())).plant
    names = (*plant.system.states, *plant.system.inputs)
    figure = Figure(figsize=(PAGE, 0.7 + 1.25 * len(names)))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    bounds = {limit.name: limit.bounds for limit in plant.given_constraints}
    for i, (axes, name) in enumerate(zip(panels, names, strict=True)):
        n = len(plant.system.states)
        for looks, reference in zip(reference_looks(references).values(), references.values(), strict=True):
            values = reference.state_at(times)[:, i] if i < n else reference.input_at(times)[:, i - n]
            axes.plot(times, values, **looks)
        _known(axes, observed.get(name, Observed()), times)
        if name in bounds:
            _between(axes, bounds[name])
        axes.set_ylabel(name)
        axes.yaxis.set_label_coords(-0.075, 0.5)  # below each other, whatever the ticks
    panels[-1].set(xlabel="time $t$ [s]", xlim=(times[0], times[-1]))
    found = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(found.values(), found, loc="outside upper center", ncols=5)
    return figure


def _known(axes: Axes, known: Observed, times: Array) -> None:
    if known.truth is not None:
        axes.plot(times, known.truth, color=INK, linewidth=0.8, zorder=2.9, label="true signal")
    if known.samples is not None:
        axes.plot(known.samples.times, known.samples.values, **SAMPLE | {"markersize": 3})
    if known.held_out is not None:
        looks = SAMPLE | {"marker": ".", "markersize": 2.5, "color": GREY, "label": "held out"}
        axes.plot(known.held_out.times, known.held_out.values, **looks)
        axes.axvline(known.held_out.times[0], color=GREY, linewidth=0.8, linestyle=":")


def _between(axes: Axes, bounds: Interval) -> None:
    """Both bounds as lines, grey beyond; what leaves them by far is cut off."""
    room = 0.12 * bounds.width
    axes.set_ylim(bounds.lower - room, bounds.upper + room)
    for bound, beyond in ((bounds.lower, bounds.lower - room), (bounds.upper, bounds.upper + room)):
        axes.axhline(bound, color=INK, linewidth=0.8, zorder=2.5)
        axes.axhspan(*sorted((bound, beyond)), facecolor=FAINT, edgecolor="none", zorder=0)
