"""The distance of each reference from its bounds over time."""

from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from trackably.plots.panels import UNKNOWN_UNITS, Units, axis_label
from trackably.plots.style import FAINT, INK, PAGE, reference_styles, styled
from trackably.systems.margins import MarginProfile

# Parts of the width between bounds: margins below the first get a logarithmic axis, which is linear below the second.
_NARROW: Final = 0.05
_LINEAR_BELOW: Final = 1e-4


@styled
def margins(profiles: Mapping[str, Sequence[MarginProfile]], units: Units = UNKNOWN_UNITS) -> Figure:
    """Draw the margins of each reference by its label, one panel for each bounded quantity, and mark the worst ones."""
    styles = reference_styles(profiles)
    quantities = [profile.quantity for profile in next(iter(profiles.values()))]
    figure = Figure(figsize=(PAGE, 0.5 + 1.7 * len(quantities)))
    panels = figure.subplots(len(quantities), 1, sharex=True, squeeze=False)[:, 0]
    for i, (axes, quantity) in enumerate(zip(panels, quantities, strict=True)):
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
    panels[-1].set_xlabel("time $t$ [s]")
    figure.align_ylabels()
    return figure


def _profile(axes: Axes, profile: MarginProfile, style: dict[str, Any]) -> None:
    margin, time = profile.worst
    worst = f"{margin:.3g}".replace("-", "−")
    axes.plot(profile.times, profile.margins, **style | {"label": f"{style['label']}:\nworst {worst} at {time:.4g} s"})
    axes.plot(time, margin, "o", color=style["color"], markeredgecolor=INK, markeredgewidth=0.7, zorder=5)


def _shade_violations(axes: Axes, shown_below: float) -> None:
    """Shade negative margins, where bounds are violated, and show at least `shown_below` of them."""
    bottom = min(axes.get_ylim()[0], -shown_below)
    axes.set_ylim(bottom)
    axes.axhspan(bottom, 0, facecolor=FAINT, edgecolor="none", zorder=0)
    axes.axhline(0, color=INK, linewidth=1.4, zorder=2)
