"""The path of a reference in the plane of two of its states."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.plots.panels import UNKNOWN_UNITS, Units, axis_label
from trackably.plots.style import BLUE, INK, NAVY, PAGE, PALE, PURPLE, SAMPLE, legend_above, reference_styles, styled
from trackably.systems.reference import Reference

_ARROWS: Final = 8
_ARROW: Final = 0.012
"""How long an arrow is, as a part of the course."""

_BROKEN: Final[tuple[dict[str, Any], ...]] = (
    {"color": PURPLE, "linewidth": 7.0, "alpha": 0.45},
    {"color": BLUE, "linewidth": 7.0, "alpha": 0.45},
    {"color": PALE, "linewidth": 7.0, "alpha": 0.9},
    {"color": NAVY, "linewidth": 7.0, "alpha": 0.35},
)
"""Styles of what is broken, in the order of the quantities."""


@styled
def path(
    references: Mapping[str, Reference],
    plane: tuple[str, str],
    times: Array,
    samples: Sequence[Samples] = (),
    truth: tuple[Array, Array] | None = None,
    units: Units = UNKNOWN_UNITS,
) -> Figure:
    """Draw references at `times` [s] in the `plane` of two states, with arrows that show where they lead.

    The first reference is marked wherever it breaks a bound. `samples` of both states are drawn where they were taken
    at the same times, and the `truth` where it is known.
    """
    figure = Figure(figsize=(PAGE, 4.2))
    axes = figure.subplots()
    if truth is not None:
        axes.plot(*truth, color=INK, linewidth=0.8, zorder=2.9, label="true signal")
    courses = {label: _in_plane(reference, plane, times) for label, reference in references.items()}
    for (label, style), course in zip(reference_styles(references).items(), courses.values(), strict=True):
        axes.plot(*course.T, **style)
        if label == next(iter(references)):
            _mark_broken(axes, label, references[label], course, times)
    _draw_direction(axes, list(courses.values())[-1])
    if len(samples) == 2 and np.array_equal(samples[0].times, samples[1].times):
        axes.plot(samples[0].values, samples[1].values, **SAMPLE | {"markersize": 4})
    label_plane(axes, plane, units)
    legend_above(figure, columns=3)
    return figure


def label_plane(axes: Axes, plane: tuple[str, str], units: Units) -> None:
    """Name both axes, and give them one scale."""
    first, second = (axis_label(name, units) for name in plane)
    axes.set(xlabel=first, ylabel=second)
    axes.set_aspect("equal", adjustable="datalim")


def _in_plane(reference: Reference, plane: tuple[str, str], times: Array) -> Array:
    """Return the two states at `times`, shape (…, 2)."""
    columns = [reference.plant.system.states.index(name) for name in plane]
    return reference.state_at(times)[..., columns]


def _mark_broken(axes: Axes, label: str, reference: Reference, course: Array, times: Array) -> None:
    """Mark the parts of a course at which a quantity is outside of its bounds, one style for each quantity."""
    styles = iter(_BROKEN * len(reference.quantities))
    for quantity in reference.quantities:
        values = quantity([signal.summed for signal in reference.signals], times)
        for outside, what in ((values < quantity.bounds.lower, "low"), (values > quantity.bounds.upper, "high")):
            if np.any(outside):
                marked = np.where(outside[:, None], course, np.nan)
                style = next(styles)
                named = f"{quantity.name.replace('_', ' ')} too {what} ({label})"
                axes.plot(*marked.T, **style, solid_capstyle="butt", zorder=2.0, label=named)


def _draw_direction(axes: Axes, course: Array) -> None:
    """Draw arrows along a course, at equal distances."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(course, axis=0), axis=1))])
    style = {"arrowstyle": "-|>", "color": INK, "mutation_scale": 20, "linewidth": 0, "shrinkA": 0, "shrinkB": 0}
    for at in (np.arange(_ARROWS) + 0.5) / _ARROWS * lengths[-1]:
        tail, head = (_point(course, lengths, at + side * _ARROW * lengths[-1]) for side in (-0.5, 0.5))
        axes.annotate("", head, tail, arrowprops=style, zorder=6)


def _point(course: Array, lengths: Array, at: float) -> tuple[float, float]:
    """Return the point of a course at a distance along it."""
    return float(np.interp(at, lengths, course[:, 0])), float(np.interp(at, lengths, course[:, 1]))
