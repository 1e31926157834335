"""Figures of references: margins over time, paths in the plane, the price of tighter bounds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle, pairwise
from math import floor, log10
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from pipeline.drawings.style import DOTTED, GREY, TRUTH, Units, axis_label, direct_label
from pipeline.margins import MarginProfile
from trackably.arrays import Array
from trackably.checker.certificate import TrueSignal
from trackably.exports.figures import (
    BLUE,
    INK,
    NAVY,
    OUTSIDE,
    PALE,
    PURPLE,
    SAMPLE,
    Observed,
    legend_above,
    panels_of,
    reference_styles,
    with_style,
)
from trackably.gp.samples import Samples
from trackably.reference.truth import sides_at
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class Shown(Observed):
    """Data of a state that an experiment knows beside its samples: the true signal `truth`, and samples `held_out`."""

    held_out: Samples | None = None
    truth: Array | None = None

    def draw(self, axes: Axes, times: Array) -> None:
        if self.truth is not None:
            axes.plot(times, self.truth, **TRUTH)
        super().draw(axes, times)
        if self.held_out is not None:
            style = SAMPLE | {"marker": ".", "markersize": 2.5, "color": GREY, "label": "held out"}
            axes.plot(self.held_out.times, self.held_out.values, **style)
            axes.axvline(self.held_out.times[0], color=GREY, **DOTTED)


# Parts of the width between bounds: below the first, margins get a logarithmic axis, which is linear below the second.
_NARROW: Final = 0.05
_LINEAR_BELOW: Final = 1e-4


@with_style
def margins(profiles: Mapping[str, Sequence[MarginProfile]], units: Units) -> Figure:
    """Draw the margins of references by label, a panel for each bounded quantity, and mark the smallest margins."""
    styles = reference_styles(profiles)
    quantities = [profile.quantity for profile in next(iter(profiles.values()))]
    figure, panels = panels_of(0.5 + 1.7 * len(quantities), len(quantities), sharex=True)
    for i, (axes, quantity) in enumerate(zip(panels[:, 0], quantities, strict=True)):
        of_quantity = {name: of_reference[i] for name, of_reference in profiles.items()}
        for name, profile in of_quantity.items():
            _profile(axes, profile, styles[name])
        axes.margins(x=0.01)
        shown_below = 0.02 * quantity.bounds.width
        closest = min(abs(profile.worst[0]) for profile in of_quantity.values())
        if closest < _NARROW * quantity.bounds.width:
            shown_below = 10 ** floor(log10(max(closest, _LINEAR_BELOW * quantity.bounds.width)))
            axes.set_yscale("symlog", linthresh=shown_below)
        _shade_violations(axes, shown_below)
        axes.set_ylabel(f"margin of {axis_label(quantity.name, units)}")
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1), borderaxespad=0, labelspacing=1)
    axes.set_xlabel("time $t$ [s]")
    figure.align_ylabels()
    return figure


def _profile(axes: Axes, profile: MarginProfile, style: dict[str, Any]) -> None:
    margin, time = profile.worst
    worst = f"{margin:.3g}".replace("-", "−")
    axes.plot(profile.times, profile.margins, **style | {"label": f"{style['label']}:\nworst {worst} at {time:.4g} s"})
    axes.plot(time, margin, "o", color=style["color"], markeredgecolor=INK, markeredgewidth=0.7, zorder=5)


def _shade_violations(axes: Axes, shown_below: float) -> None:
    """Shade the range of negative margins, and let the axis reach down to −`shown_below` at least."""
    bottom = min(axes.get_ylim()[0], -shown_below)
    axes.set_ylim(bottom)
    axes.axhspan(bottom, 0, **OUTSIDE)
    axes.axhline(0, color=INK, linewidth=1.4, zorder=2)


@with_style
def true_signals(
    reference: Reference, truths: Sequence[TrueSignal], sampled: Mapping[str, Samples], units: Units
) -> Figure:
    """Draw the differences between true signals and the reference, one panel for each state.

    A band shows where true signals may be. Samples have bars as long as the sensor's error. Thin lines are the proved
    distance in each interval between samples; dotted lines are the proved distance of the plant at steps, if it is
    disturbed.
    """
    figure, panels = panels_of(0.6 + 2.2 * len(truths), len(truths), sharex=True)
    for axes, truth in zip(panels[:, 0], truths, strict=True):
        times = np.unique(np.concatenate([np.linspace(a, b, _IN_A_CELL) for a, b in pairwise(truth.ends)]))
        off = states_of(reference, [truth.state], times)[:, 0]
        upper, lower = sides_at(truth, times)
        axes.fill_between(times, lower - off, upper - off, color=PALE, linewidth=0, label="possible true signals")
        samples = sampled[truth.state]
        beside = samples.values - states_of(reference, [truth.state], samples.times)[:, 0]
        style = {"fmt": "none", "ecolor": GREY, "elinewidth": 0.8, "zorder": 2.7}
        axes.errorbar(samples.times, beside, float(truth.of.samples.noise), **style)
        axes.plot(samples.times, beside, **SAMPLE | {"markersize": 3})
        axes.axhline(0, color=NAVY, linewidth=1.2, label="reference")
        for sign, label in ((1.0, "proved distance"), (-1.0, None)):
            axes.stairs(sign * np.array(truth.errors), truth.ends, baseline=None, color=INK, linewidth=0.8, label=label)
            if truth.plant is not None:
                named = "that of the plant" if label else None
                axes.axhline(sign * truth.plant, color=PURPLE, linewidth=1.0, linestyle=":", label=named)
        axes.set_ylabel(f"{axis_label(truth.state, units)} minus reference")
    axes.set(xlabel="time $t$ [s]", xlim=(truths[0].ends[0], truths[0].ends[-1]))
    return legend_above(figure, columns=5)


_IN_A_CELL: Final = 17
_ARROWS: Final = 8
_ARROW: Final = 0.012
"""The length of an arrow, as a part of the length of the path."""

_BROKEN: Final = ((PURPLE, 0.45), (BLUE, 0.45), (PALE, 0.9), (NAVY, 0.35))
"""Colours and opacities that mark broken bounds, one for each quantity in their order."""


@with_style
def path(
    references: Mapping[str, Reference],
    plane: tuple[str, str],
    times: Array,
    samples: Sequence[Samples],
    truth: tuple[Array, Array] | None,
    units: Units,
) -> Figure:
    """Draw references at `times` [s] in the `plane` of two states, with arrows that show where they lead.

    The parts of the first reference that break a bound are marked. `samples` of both states are drawn if they were
    taken at the same times, and the true signal `truth` if it is known.
    """
    figure, [[axes]] = panels_of(4.2)
    if truth is not None:
        axes.plot(*truth, **TRUTH)
    courses = {label: states_of(reference, plane, times) for label, reference in references.items()}
    for (label, style), course in zip(reference_styles(references).items(), courses.values(), strict=True):
        axes.plot(*course.T, **style)
        if label == next(iter(references)):
            _mark_broken(axes, label, references[label], course, times)
    _draw_direction(axes, list(courses.values())[-1])
    if len(samples) == 2 and np.array_equal(samples[0].times, samples[1].times):
        axes.plot(samples[0].values, samples[1].values, **SAMPLE | {"markersize": 4})
    axes.set(xlabel=axis_label(plane[0], units), ylabel=axis_label(plane[1], units))
    axes.set_aspect("equal", adjustable="datalim")
    return legend_above(figure, columns=3)


def states_of(reference: Reference, names: Sequence[str], times: Array) -> Array:
    """Return these states of a reference at `times` [s] (n,), shape (n, len(names))."""
    return np.asarray(reference.state_at(times)[:, [reference.plant.system.states.index(name) for name in names]])


def _mark_broken(axes: Axes, label: str, reference: Reference, course: Array, times: Array) -> None:
    """Mark the parts of a path (n, 2) at which a quantity is outside of its bounds, one style for each quantity."""
    styles = cycle(_BROKEN)
    for quantity in reference.quantities:
        values = quantity([signal.summed for signal in reference.signals], times)
        for outside, what in ((values < quantity.bounds.lower, "low"), (values > quantity.bounds.upper, "high")):
            if np.any(outside):
                marked = np.where(outside[:, None], course, np.nan)
                (color, alpha), named = next(styles), f"{quantity.name.replace('_', ' ')} too {what} ({label})"
                style: dict[str, Any] = {"color": color, "alpha": alpha, "linewidth": 7.0, "solid_capstyle": "butt"}
                axes.plot(*marked.T, **style, zorder=2.0, label=named)


def _draw_direction(axes: Axes, course: Array) -> None:
    """Draw arrows along a path (n, 2), at equal distances."""
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(course, axis=0), axis=1))])
    style = {"arrowstyle": "-|>", "color": INK, "mutation_scale": 20, "linewidth": 0, "shrinkA": 0, "shrinkB": 0}
    middles = (np.arange(_ARROWS) + 0.5) / _ARROWS * lengths[-1]
    ends = ([np.interp(middles + side * _ARROW * lengths[-1], lengths, x) for x in course.T] for side in (-0.5, 0.5))
    for tail, head in zip(*(np.transpose(of).tolist() for of in ends), strict=True):
        axes.annotate("", head, tail, arrowprops=style, zorder=6)


_MARKS: Final = "so^"


@with_style
def tightness(
    found: Mapping[str, Mapping[str, Sequence[float]]], baseline: str, least: float, noise_std: float
) -> Figure:
    """Draw price, misfit and error of references by their labels over the upper bound of the state, tightest last.

    The price is J minus `least`, the l of the reference `baseline`. References have the styles of other figures, in
    which `baseline` is the first one. `noise_std` is drawn beside the misfit.
    """
    figure, (panels,) = panels_of(2.7, 1, 3)
    uppers = sorted({upper for of in found.values() for upper in of["uppers"]}, reverse=True)
    _, *styles = reference_styles((baseline, *found)).values()
    for of, style, marker in zip(found.values(), styles, cycle(_MARKS), strict=False):
        curves = (np.array(of["objectives"]) - least, of["misfits"], of["errors"])
        for axes, values in zip(panels, curves, strict=True):
            axes.plot(of["uppers"], values, **style, marker=marker, markersize=3.5)
    labels = (r"price $J - \min l$ [–]", "misfit of the samples [–]", "error to the truth [–]")
    for axes, label in zip(panels, labels, strict=True):
        axes.set(xscale="log", yscale="log", xlabel="upper bound of the state [–]", ylabel=label)
        axes.invert_xaxis()
        axes.set_xticks(uppers[::2], [f"{upper:g}" for upper in uppers[::2]])
        axes.xaxis.set_minor_locator(NullLocator())
    panels[1].axhline(noise_std, color=GREY, **DOTTED, zorder=2)
    where = panels[1].get_yaxis_transform()
    direct_label(panels[1], 0.02, noise_std, r"noise $\sigma_\mathrm{n}$", transform=where, va="bottom", color=INK)
    return legend_above(figure)
