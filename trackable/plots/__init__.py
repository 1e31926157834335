"""Figures: functions from the library's dataclasses to a matplotlib Figure. Only this package imports matplotlib."""

from trackable.plots.convergence import convergence
from trackable.plots.feasible import feasible_intervals, feasible_polygons
from trackable.plots.illustrations import asymptotic, tube
from trackable.plots.landscape import landscape
from trackable.plots.loops.closed_loop import closed_loop, costs
from trackable.plots.loops.disturbed import disturbed_loops, price_of_room, tube_runs
from trackable.plots.loops.events import infeasibility, relearned
from trackable.plots.margins import margins
from trackable.plots.periodic import GrowthIntervals, conservatism, growth_intervals, periodic_prediction
from trackable.plots.plane.loops import loops_in_plane
from trackable.plots.plane.path import path
from trackable.plots.prediction import Published, prediction
from trackable.plots.scheme import scheme
from trackable.plots.style import save, svg
from trackable.plots.tightness import tightness
from trackable.plots.tracking import Observed, tracking

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
