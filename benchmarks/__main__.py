"""`python -m benchmarks`: everything, written to this folder; with names of comparisons only those, and only shown."""

import sys
from collections.abc import Iterator
from importlib import import_module
from itertools import chain

from threadpoolctl import threadpool_limits

from benchmarks import report
from benchmarks.harness import FAILURES, Row, described, load

_ALL = ("likelihood", "constrained", "recordings", "growth", "loops")


def measured(name: str) -> Iterator[Row]:
    """The rows of one file of comparisons, said as they come; where a file cannot go on, a row says why."""
    try:
        for row in import_module(f"benchmarks.{name}").rows():
            print(f"{row.topic}, {row.problem}, beside {row.rival}: {row.failure or f'{row.ratio:.3g} {row.verdict}'}")
            yield row
    except FAILURES as why:
        print(f"{name}: {why}")
        yield Row.failed(name, "all that follows", "whatever is next", why)


if __name__ == "__main__":
    names = sys.argv[1:] or _ALL
    if unknown := set(names) - set(_ALL):
        sys.exit(f"python -m benchmarks [NAME ...]: {', '.join(sorted(unknown))} is none of {', '.join(_ALL)}")
    with threadpool_limits(limits=1):
        before = load()
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
