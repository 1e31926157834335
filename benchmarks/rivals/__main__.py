"""`python -m benchmarks.rivals`: everything, written to this folder; with names of problems only those, and shown.

`python -m benchmarks.rivals page` writes the page again, from what was measured.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from importlib import import_module

from threadpoolctl import threadpool_limits

from benchmarks.rivals import joints, page, pendulum, table
from benchmarks.rivals.adapters import fine_grid, ours, splines, tightened, truncated
from benchmarks.rivals.page import RIVALS
from benchmarks.rivals.problems import problem, problems
from benchmarks.rivals.tables import write

POINTS = (13, 25, 50, 100, 200, 400, 800)
ON_GRIDS = {
    fine_grid.solve: "the same program on a grid",
    splines.solve: "smoothing spline on a grid",
    tightened.solve: "second-order cones",
}
AT_ONCE = (truncated.solve, ours.alone, ours.joint)


def sweep(name: str = "axis") -> Iterator[table.Row]:
    """Yield the rows of all rivals with a grid, and of those without one."""
    of, rivals = problem(name), {rival.solve: rival for rival in RIVALS}
    for solve, short in ON_GRIDS.items():
        for points in POINTS:
            yield table.measured(of, replace(rivals[solve], name=short, solve=partial(solve, points=points)))
    for at_once in AT_ONCE:
        yield table.measured(of, rivals[at_once])


def main(names: list[str]) -> None:
    """Measure row by row; each is written as soon as it is there."""
    if names == ["page"]:
        page.write()
        return
    wanted = [problem for problem in problems() if not names or problem.name in names]
    if unknown := set(names) - {problem.name for problem in wanted}:
        sys.exit(f"python -m benchmarks.rivals [NAME ...]: no problem is named {', '.join(sorted(unknown))}")
    for package in {package for rival in RIVALS for package in rival.needs}:
        import_module(package)  # loading is no part of a rival's time
    rows = []
    for each in wanted:
        for rival in RIVALS:
            rows.append(found := table.measured(each, rival))
            least = "" if found.least is None else f", violation {found.least:.3g}"
            print(f"{each.name}: {rival.name}: {found.answer}{least}", flush=True)
        if not names:
            write(rows, page.RESULTS)
    if names:
        print(table.page(rows))
    else:
        write(pendulum.rows(), page.PENDULUM)
        write(sweep(), page.SWEEP)
        write(joints.rows(), page.JOINTS)
        page.write()


if __name__ == "__main__":
    with threadpool_limits(limits=1):
        main(sys.argv[1:])
