"""`python -m benchmarks.rivals.study --runs 10000 --workers 2 --folder FOLDER`: the study, resumed where it stopped."""

import argparse
import os
import sys
from pathlib import Path

from benchmarks.rivals.problems import ROOT
from benchmarks.rivals.study.run import collected, run
from benchmarks.rivals.study.summary import page, summary, write


def main(arguments: list[str]) -> None:
    """Do what is missing, say how far it is, and write the summary."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rivals.study", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000, help="how many (10000)")
    parser.add_argument("--workers", type=int, default=2, help="processes of this machine (2)")
    parser.add_argument("--cluster", help="the address of a Dask scheduler, instead of workers")
    parser.add_argument("--folder", type=Path, required=True, help="where the runs are kept")
    parser.add_argument("--summary", type=Path, help="where the summary is written, as JSON")
    given = parser.parse_args(arguments)
    folder, written = given.folder.resolve(), given.summary.resolve() if given.summary else None
    os.chdir(ROOT)
    for done in run(folder, given.runs, given.workers, given.cluster):
        print(f"{done} of {given.runs} runs", file=sys.stderr, flush=True)
    entries = summary(collected(folder, given.runs))
    if written:
        write(entries, given.runs, written)
    print(page(entries))


if __name__ == "__main__":
    main(sys.argv[1:])
