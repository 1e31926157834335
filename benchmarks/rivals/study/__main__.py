"""`python -m benchmarks.rivals.study --folder FOLDER`: the study, resumed where it stopped.

With `--check FILE` it compares itself with a summary that was written before, as far as its runs go, and exits with 1
where that is not reproduced.
"""

import argparse
import os
import sys
from pathlib import Path

from benchmarks.rivals.problems import ROOT
from benchmarks.rivals.study.draws import COMBINATIONS
from benchmarks.rivals.study.run import collected, run
from benchmarks.rivals.study.summary import differences, page, read, runs_in, summary, write


def main(arguments: list[str]) -> None:
    """Do what is missing, say how far it is, and write or compare the summary."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rivals.study", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000, help="how many (10000)")
    parser.add_argument("--workers", type=int, default=2, help="processes of this machine (2)")
    parser.add_argument("--cluster", help="the address of a Dask scheduler, instead of workers")
    parser.add_argument("--folder", type=Path, required=True, help="where the runs are kept")
    parser.add_argument("--summary", type=Path, help="where the summary is written, as JSON")
    parser.add_argument("--check", type=Path, help="a summary that was written before")
    given = parser.parse_args(arguments)
    folder, written, before = (path.resolve() if path else None for path in (given.folder, given.summary, given.check))
    assert folder is not None, "it is required"
    os.chdir(ROOT)
    for done in run(folder, given.runs, given.workers, given.cluster):
        print(f"{done} of {given.runs} runs", file=sys.stderr, flush=True)
    sizes = sorted({min(COMBINATIONS, given.runs), given.runs})
    summaries = [summary(collected(folder, size)) for size in sizes]
    if written:
        write(summaries, written)
    print(page(summaries[-1]))
    if before:
        sys.exit(_compared(folder, given.runs, before))


def _compared(folder: Path, runs: int, before: Path) -> int:
    """Print what differs from the summaries of as many runs or fewer; return the exit code."""
    known = [entries for entries in read(before) if runs_in(entries) <= runs]
    if not known:
        print(f"{before.name}: has no summary of {runs} runs or fewer", file=sys.stderr)
        return 1
    found = [line for entries in known for line in differences(summary(collected(folder, runs_in(entries))), entries)]
    for line in found:
        print(line, file=sys.stderr)
    sizes = " and of ".join(str(runs_in(entries)) for entries in known)
    print(f"{before.name}: the summary of {sizes} runs is {'not ' if found else ''}reproduced", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    main(sys.argv[1:])
