"""Figures: the mathematics' dataclasses in, a matplotlib Figure out. The only place that knows matplotlib."""

from pipeline.plots.closed_loop import closed_loop, costs, infeasibility, relearned
from pipeline.plots.convergence import convergence
from pipeline.plots.feasible import feasible_intervals, feasible_polygons
from pipeline.plots.illustrations import asymptotic, tube
from pipeline.plots.landscape import landscape
from pipeline.plots.margins import margins
from pipeline.plots.periodic import GrowthIntervals, conservatism, growth_intervals, periodic_prediction
from pipeline.plots.prediction import Published, prediction
from pipeline.plots.style import save, svg
from pipeline.plots.tracking import Observed, tracking

__all__ = [
    "GrowthIntervals",
    "Observed",
    "Published",
    "asymptotic",
    "closed_loop",
    "conservatism",
    "convergence",
    "costs",
    "feasible_intervals",
    "feasible_polygons",
    "growth_intervals",
    "infeasibility",
    "landscape",
    "margins",
    "periodic_prediction",
    "prediction",
    "relearned",
    "save",
    "svg",
    "tracking",
    "tube",
]
