"""Run the study: in parallel, resumed where it was stopped, the same bytes however many workers there are."""

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks.rivals.study.outcome import Outcome, outcomes

Measure = Callable[[int], list[Outcome]]


def run(
    folder: Path, count: int, workers: int = 1, cluster: str | None = None, measure: Measure = outcomes
) -> Iterator[int]:
    """Do the first `count` runs that are not done yet, in their order; yield how many are done.

    Each run is a line of a file in `folder`, written when it and all before it are done: what is done stays when the
    study is stopped. `cluster` is the address of a Dask scheduler; without it `workers` processes of this machine are
    used. `measure` does one run.
    """
    from joblib import Parallel, delayed, parallel_config

    folder.mkdir(parents=True, exist_ok=True)
    with _file(folder).open("a+", encoding="utf-8") as kept:
        kept.seek(0)
        done = sum(1 for _ in kept)
        yield done
        place = {"backend": "dask", "scheduler_host": cluster} if cluster else {"n_jobs": workers}
        with parallel_config(**place):
            parallel = Parallel(return_as="generator")
            for line in parallel(delayed(_measured)(measure, index) for index in range(done, count)):
                kept.write(line)
                kept.flush()
                yield (done := done + 1)


def _measured(measure: Measure, index: int) -> str:
    """Return the outcomes of one run as a line of JSON."""
    with threadpool_limits(limits=1):
        return json.dumps([asdict(outcome) for outcome in measure(index)], ensure_ascii=False) + "\n"


def _file(folder: Path) -> Path:
    return folder / "runs.jsonl"


def collected(folder: Path, count: int) -> list[Outcome]:
    """Return the outcomes of the first `count` runs, ordered by index."""
    lines = _file(folder).read_text("utf-8").splitlines()[:count]
    return [Outcome(**entry) for line in lines for entry in json.loads(line)]
