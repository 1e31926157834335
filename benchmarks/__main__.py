"""`python -m benchmarks`: everything, written to this folder; with names of comparisons only those, and only shown."""

import sys
from importlib import import_module
from itertools import chain

from threadpoolctl import threadpool_limits

from benchmarks import report
from benchmarks.duel import Row
from benchmarks.machine import described, load

_ALL = ("likelihood", "constrained", "jointly", "recorded", "growth", "mpc", "imports")


def measured(name: str) -> list[Row]:
    """The rows of one file of comparisons, said as they come."""
    found = []
    for row in import_module(f"benchmarks.{name}").rows():
        print(f"{row.topic}, {row.problem}, beside {row.rival}: {row.ratio:.3g} {row.verdict}", flush=True)
        found.append(row)
    return found


if __name__ == "__main__":
    names = sys.argv[1:] or _ALL
    if unknown := set(names) - set(_ALL):
        sys.exit(f"python -m benchmarks [NAME ...]: {', '.join(sorted(unknown))} is none of {', '.join(_ALL)}")
    with threadpool_limits(limits=1):
        before = load()
        rows = list(chain.from_iterable(measured(name) for name in names))
        machine = described(before)
    if not sys.argv[1:]:
        report.write(rows, machine)
    else:
        print(report.table(rows, machine))
