"""References of systems with any number of states and inputs, over time and between their bounds."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.arrays import Array
from trackably.control.angles import angles_of
from trackably.gp.samples import Samples
from trackably.plots.panels import (
    UNKNOWN_UNITS,
    Units,
    axis_label,
    bounds_of,
    coordinates,
    pad_limits,
    shade_outside,
)
from trackably.plots.style import GREY, INK, PAGE, SAMPLE, legend_above, reference_styles, styled
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class Observed:
    """What is known of a state: the `samples` that it is learned from, those `held_out`, and the true signal."""

    samples: Samples | None = None
    held_out: Samples | None = None
    truth: Array | None = None


@styled
def tracking(
    references: Mapping[str, Reference],
    observed: Mapping[str, Observed],
    times: Array,
    units: Units = UNKNOWN_UNITS,
) -> Figure:
    """Draw each state and input at `times` [s], what is `observed` of it, and its own bounds.

    Values far outside the bounds are cut off, and angles do not jump by whole turns. Bounds of sums of several states
    or inputs are not drawn.
    """
    plant = next(iter(references.values())).plant
    names, bounds = coordinates(plant), bounds_of(plant)
    figure = Figure(figsize=(PAGE, 0.7 + 1.25 * len(names)))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for i, (axes, name) in enumerate(zip(panels, names, strict=True)):
        n = len(plant.system.states)
        for style, reference in zip(reference_styles(references).values(), references.values(), strict=True):
            values = reference.state_at(times)[:, i] if i < n else reference.input_at(times)[:, i - n]
            axes.plot(times, np.unwrap(values) if i in angles_of(plant) else values, **style)
        _draw_observed(axes, observed.get(name, Observed()), times)
        if name in bounds:
            pad_limits(axes, bounds[name])
            shade_outside(axes, bounds[name])
        axes.set_ylabel(axis_label(name, units))
        axes.yaxis.set_label_coords(-0.075, 0.5)  # aligned, whatever the width of the tick labels
    panels[-1].set(xlabel="time $t$ [s]", xlim=(times[0], times[-1]))
    legend_above(figure, columns=5)
    return figure


def _draw_observed(axes: Axes, observed: Observed, times: Array) -> None:
    if observed.truth is not None:
        axes.plot(times, observed.truth, color=INK, linewidth=0.8, zorder=2.9, label="true signal")
    if observed.samples is not None:
        style = SAMPLE | {"markersize": 3} | ({"label": "centres"} if observed.samples.scatters else {})
        axes.plot(observed.samples.times, observed.samples.values, **style)
    if observed.held_out is not None:
        style = SAMPLE | {"marker": ".", "markersize": 2.5, "color": GREY, "label": "held out"}
        axes.plot(observed.held_out.times, observed.held_out.values, **style)
        axes.axvline(observed.held_out.times[0], color=GREY, linewidth=0.8, linestyle=":")
