"""Run the study: in parallel, resumed where it was stopped, the same bytes however many workers there are."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

from threadpoolctl import threadpool_limits

from benchmarks.rivals.study.outcome import Outcome, outcomes
from trackably.files import write_atomically

Measure = Callable[[int], list[Outcome]]

CHUNK = 20


def run(
    folder: Path, count: int, workers: int = 1, cluster: str | None = None, measure: Measure = outcomes
) -> Iterator[int]:
    """Do the first `count` runs that are not done yet; yield how many are, chunk by chunk.

    Every chunk is a file of its own in `folder`, written when its runs are done: what is done stays when the study is
    stopped. The last chunk is done to its end, so that a longer study finds it whole. `cluster` is the address of a
    Dask scheduler; without it `workers` processes of this machine are used.
    `measure` does one run.
    """
    from joblib import Parallel, delayed

    folder.mkdir(parents=True, exist_ok=True)
    missing = [chunk for chunk in _chunks(count) if not _file(folder, chunk).exists()]
    done = count - sum(min(chunk.stop, count) - chunk.start for chunk in missing)
    yield done
    with _backend(cluster):
        parallel = Parallel(n_jobs=-1 if cluster else workers, return_as="generator_unordered")
        for chunk, text in parallel(delayed(_measured)(measure, chunk) for chunk in missing):
            write_atomically(_file(folder, chunk), text.encode())
            done += min(chunk.stop, count) - chunk.start
            yield done


@contextmanager
def _backend(cluster: str | None) -> Iterator[None]:
    """Send what is done inside the block to a cluster, if there is one."""
    if cluster is None:
        yield
        return
    from distributed import Client
    from joblib import parallel_config

    with Client(cluster), parallel_config(backend="dask"):
        yield


def _measured(measure: Measure, chunk: range) -> tuple[range, str]:
    """Return the outcomes of some runs as lines of JSON."""
    with threadpool_limits(limits=1):
        lines = [json.dumps(asdict(outcome), ensure_ascii=False) for index in chunk for outcome in measure(index)]
    return chunk, "\n".join(lines) + "\n"


def _chunks(count: int) -> list[range]:
    return [range(first, first + CHUNK) for first in range(0, count, CHUNK)]


def _file(folder: Path, chunk: range) -> Path:
    return folder / f"{chunk.start:06d}-{chunk.stop - 1:06d}.jsonl"


def collected(folder: Path, count: int) -> list[Outcome]:
    """Return the outcomes of the first `count` runs, ordered by index. FileNotFoundError: some are not done."""
    lines = (line for chunk in _chunks(count) for line in _file(folder, chunk).read_text("utf-8").splitlines())
    found = (Outcome(**json.loads(line)) for line in lines)
    return [outcome for outcome in found if outcome.index < count]
