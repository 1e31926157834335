"""How much of a bound is broken between the times of a grid, as it is made finer: a row for each fineness."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from benchmarks.rivals.adapters import fine_grid, ours, splines, tightened, truncated
from benchmarks.rivals.model import Answer, Problem, Rival
from benchmarks.rivals.problems import problem
from benchmarks.rivals.table import Row, measured

POINTS = (13, 25, 50, 100, 200, 400, 800)
ON_GRIDS: tuple[tuple[Rival, Callable[[Problem, int], Answer], str], ...] = (
    (fine_grid.FINE_GRID, fine_grid.solve, "the same program on a grid"),
    (splines.SPLINE, splines.solve, "smoothing spline on a grid"),
    (tightened.TIGHTENED, tightened.solve, "second-order cones"),
)
AT_ONCE = (truncated.MODE, ours.HYPERPARAMETERS, ours.JOINT)


def rows(name: str = "axis") -> Iterator[Row]:
    """Yield the rows of all rivals with a grid, and of those without one."""
    of = problem(name)
    for rival, solve, short in ON_GRIDS:
        for points in POINTS:
            yield measured(of, replace(rival, name=short, solve=partial(solve, points=points)))
    for rival in AT_ONCE:
        yield measured(of, rival)
