"""Figures of closed loops."""

from collections.abc import Callable

from matplotlib.figure import Figure

from pipeline.experiments import Experiment
from pipeline.storage.loops import read_loops
from pipeline.storage.results import Results
from trackable import plots

_CERTIFIED, _UNCONSTRAINED, _ON = "certified", "unconstrained", "on"


def drawings(experiment: Experiment, results: Results) -> dict[str, Callable[[], Figure]]:
    """The figures by name, each drawn when it is called. Raises as `read_loops`."""
    plant, wanted = experiment.constrained_system, experiment.control
    closed = read_loops(results, plant)
    courses, shown = closed.courses, min(wanted.shown, wanted.logged, wanted.steps)
    by_name: dict[str, Callable[[], Figure]] = {
        "closed-loop": lambda: plots.closed_loop(courses, plant, shown),
        "cost": lambda: plots.costs(courses, plant, shown),
    }
    lost = courses[_UNCONSTRAINED][_ON]
    if lost.infeasible.size:
        by_name["infeasibility"] = lambda: plots.infeasibility(lost, plant, wanted.horizon)
    online, offered = closed.online, closed.offered
    if online is not None and offered is not None:
        by_name["relearning"] = lambda: plots.relearned(online, offered, plant)
    if not closed.feasible:
        return by_name
    if len(plant.system.states) == 1:
        certified = courses[_CERTIFIED][_ON]
        by_name["feasible-set"] = lambda: plots.feasible_intervals(closed.feasible, certified, plant)
    else:
        by_name["feasible-set"] = lambda: plots.feasible_polygons(closed.feasible, courses[_CERTIFIED], plant)
    return by_name
