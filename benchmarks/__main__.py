"""`python -m benchmarks [NAME …]`: run all comparisons and write them to this folder; with names, only print these."""

import os
import sys
from collections.abc import Iterator
from importlib import import_module
from itertools import chain

from threadpoolctl import threadpool_limits

from benchmarks import report
from benchmarks.harness import Row, attempted, described

_ALL = ("likelihood", "constrained", "recordings", "growth", "loops")


def measured(name: str) -> Iterator[Row]:
    """Yield and print the rows of one module of comparisons; if the module fails, the last row says why."""
    for row in attempted(name, "all that follows", "whatever is next", import_module(f"benchmarks.{name}").rows):
        print(f"{row.topic}, {row.problem}, beside {row.rival}: {row.failure or f'{row.ratio:.3g} {row.verdict}'}")
        yield row


if __name__ == "__main__":
    names = sys.argv[1:] or _ALL
    if unknown := set(names) - set(_ALL):
        sys.exit(f"python -m benchmarks [NAME ...]: {', '.join(sorted(unknown))} is none of {', '.join(_ALL)}")
    with threadpool_limits(limits=1):
        before = os.getloadavg()[0]
        rows: list[Row] = []
        for row in chain.from_iterable(map(measured, names)):
            rows.append(row)
            if not sys.argv[1:]:
                report.write_rows(rows, described(before))
        machine = described(before)
    if not sys.argv[1:]:
        report.write(rows, machine)
    else:
        print(report.table(rows, machine))
