"""The figure of a reference: states and inputs between their bounds."""

from matplotlib.figure import Figure

from trackably.exports.proved import Proved, proved_times
from trackably.exports.shown.extent import shown_times
from trackably.plots.tracking import Observed, tracking

_COUNT = 801


def figure(proved: Proved, start: float | None = None, end: float | None = None) -> Figure:
    """Draw a reference from `start` to `end` [s] with its samples, where they are of states.

    Raises ValueError for times outside of what is proved.
    """
    times = proved_times(proved, shown_times(proved, _COUNT, start, end))
    observed = {name: Observed(samples) for name, samples in proved.sampled.items()}
    return tracking({"reference": proved.reference}, observed, times)
