"""Figures of closed loops."""

from collections.abc import Callable

from matplotlib.figure import Figure

from pipeline.experiments import Experiment
from pipeline.loops.initial_states import ON
from pipeline.methods import JOINT, UNCONSTRAINED
from pipeline.storage.loops import read_loops
from pipeline.storage.results import Results
from trackably import plots


def drawings(experiment: Experiment, results: Results) -> dict[str, Callable[[], Figure]]:
    """Return the figures by name, each drawn when it is called. Raises as `read_loops`."""
    plant, wanted, units = experiment.plant, experiment.control, experiment.units
    closed = read_loops(results, plant)
    courses, steps = closed.courses, experiment.loop_steps
    shown = steps.start + min(wanted.shown, wanted.logged, len(steps))
    by_name: dict[str, Callable[[], Figure]] = {
        "closed-loop": lambda: plots.closed_loop(courses, plant, shown, units),
        "cost": lambda: plots.costs(courses, plant, shown),
    }
    if (plane := experiment.plane) is not None:
        by_name["loops-in-plane"] = lambda: plots.loops_in_plane(courses[JOINT.name], plant, plane, shown, units)
    lost = courses[UNCONSTRAINED.name][ON]
    if lost.infeasible.size:
        by_name["infeasibility"] = lambda: plots.infeasibility(lost, plant, wanted.horizon, units)
    online, offered = closed.online, closed.offered
    if online is not None and offered is not None:
        by_name["relearning"] = lambda: plots.relearned(online, offered, plant, units)
    if not closed.feasible:
        return by_name
    if len(plant.system.states) == 1:
        followed = courses[JOINT.name][ON]
        by_name["feasible-set"] = lambda: plots.feasible_intervals(closed.feasible, followed, plant, units)
    else:
        by_name["feasible-set"] = lambda: plots.feasible_polygons(closed.feasible, courses[JOINT.name], plant, units)
    return by_name
