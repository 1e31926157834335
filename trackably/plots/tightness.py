"""What a guarantee costs, as a bound is drawn in: the price, and the distances to samples and truth."""

from collections.abc import Mapping
from itertools import cycle
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from trackably.learning.published.study import Tightness
from trackably.plots.style import GREY, INK, PAGE, direct_label, legend_above, reference_styles, styled

_MARKERS: Final = "so^"


@styled
def tightness(found: Mapping[str, Tightness], baseline: str, least: float, noise_std: float) -> Figure:
    """Draw price, misfit and error of references by their labels over the upper bound of the state, tightest last.

    The price is J minus `least`, the l of the reference `baseline`, which is named first in other figures and keeps its
    style there. `noise_std` is drawn beside the misfit.
    """
    figure = Figure(figsize=(PAGE, 2.7))
    panels = figure.subplots(1, 3)
    uppers = sorted({upper for of in found.values() for upper in of.uppers.tolist()}, reverse=True)
    _, *styles = reference_styles((baseline, *found)).values()
    for of, style, marker in zip(found.values(), styles, cycle(_MARKERS), strict=False):
        curves = (of.objectives - least, of.misfits, of.errors)
        for axes, values in zip(panels, curves, strict=True):
            axes.plot(of.uppers, values, **style, marker=marker, markersize=3.5)
    labels = (r"price $J - \min l$ [–]", "misfit of the samples [–]", "error to the truth [–]")
    for axes, label in zip(panels, labels, strict=True):
        axes.set(xscale="log", yscale="log", xlabel="upper bound of the state [–]", ylabel=label)
        axes.invert_xaxis()
        axes.set_xticks(uppers[::2], [f"{upper:g}" for upper in uppers[::2]])
        axes.xaxis.set_minor_locator(NullLocator())
    _noise(panels[1], noise_std)
    legend_above(figure)
    return figure


def _noise(axes: Axes, noise_std: float) -> None:
    axes.axhline(noise_std, color=GREY, linewidth=0.8, linestyle=":", zorder=2)
    where = axes.get_yaxis_transform()
    direct_label(axes, 0.02, noise_std, r"noise $\sigma_\mathrm{n}$", transform=where, va="bottom", color=INK)
