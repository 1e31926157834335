"""Figures: functions from the library's dataclasses to a matplotlib Figure. Only this package imports matplotlib."""

from trackably.plots.convergence import convergence
from trackably.plots.feasible import feasible_intervals, feasible_polygons
from trackably.plots.illustrations import asymptotic, tube
from trackably.plots.landscape import landscape
from trackably.plots.loops.closed_loop import closed_loop, costs
from trackably.plots.loops.disturbed import disturbed_loops, price_of_room, tube_runs
from trackably.plots.loops.events import infeasibility, relearned
from trackably.plots.margins import margins
from trackably.plots.periodic import GrowthIntervals, conservatism, growth_intervals, periodic_prediction
from trackably.plots.plane.loops import loops_in_plane
from trackably.plots.plane.path import path
from trackably.plots.prediction import Published, prediction
from trackably.plots.scheme import scheme
from trackably.plots.style import save, svg
from trackably.plots.tightness import tightness
from trackably.plots.tracking import Observed, tracking

__all__ = [
    "GrowthIntervals",
    "Observed",
    "Published",
    "asymptotic",
    "closed_loop",
    "conservatism",
    "convergence",
    "costs",
    "disturbed_loops",
    "feasible_intervals",
    "feasible_polygons",
    "growth_intervals",
    "infeasibility",
    "landscape",
    "loops_in_plane",
    "margins",
    "path",
    "periodic_prediction",
    "prediction",
    "price_of_room",
    "relearned",
    "save",
    "scheme",
    "svg",
    "tightness",
    "tracking",
    "tube",
    "tube_runs",
]
