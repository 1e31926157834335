"""`python -m benchmarks.rivals.study --folder FOLDER`: the study, resumed where it stopped.

With `--check FILE` it compares itself with a summary that was written before, and exits with 1 where that is not
reproduced.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.rivals.study.draws import COMBINATIONS
from benchmarks.rivals.study.run import collected, run
from benchmarks.rivals.study.summary import differences, page, read, summary, write


def main(arguments: list[str]) -> None:
    """Do what is missing, say how far it is, and write or compare the summary."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rivals.study", description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000, help="how many (10000)")
    parser.add_argument("--workers", type=int, default=2, help="processes of this machine (2)")
    parser.add_argument("--cluster", help="the address of a Dask scheduler, instead of workers")
    parser.add_argument("--folder", type=Path, required=True, help="where the runs are kept")
    parser.add_argument("--summary", type=Path, help="where the summary is written, as JSON")
    parser.add_argument("--check", type=Path, help="a summary that was written before, of as many runs")
    given = parser.parse_args(arguments)
    for done in run(given.folder, given.runs, given.workers, given.cluster):
        print(f"{done} of {given.runs} runs", file=sys.stderr, flush=True)
    sizes = sorted({min(COMBINATIONS, given.runs), given.runs})
    summaries = [summary(collected(given.folder, size)) for size in sizes]
    if given.summary:
        write(summaries, given.summary)
    print(page(summaries[-1]))
    if given.check:
        pairs = zip(summaries, read(given.check), strict=False)
        found = [line for now, before in pairs for line in differences(now, before)]
        sys.exit("\n".join([*found, f"{given.check}: not reproduced"]) if found else None)


if __name__ == "__main__":
    main(sys.argv[1:])
