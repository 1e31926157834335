"""Two hundred recordings through `learn_many`: by one worker and by two, and killed half-way and resumed."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.duel import Disagreement, Row
from benchmarks.loops.windows import integrator
from trackably import Fleet, Samples, SquaredExponential, learn_many

_COUNT, _KILLED_AT = 200, 100  # recordings
_RATE, _SPAN, _NOISE = 10.0, 6.0, 0.05  # samples a second, seconds, unit of the position
_JITTER, _KEPT = 0.02, 0.9  # seconds; the part of the samples that is not lost
_TOPIC = f"{_COUNT} recordings learned and proved"


def rows() -> Iterator[Row]:
    """Each run is a process of its own, timed by the clock; all folders must hold the same bytes."""
    with TemporaryDirectory() as folder:
        one, two, stopped = (Path(folder) / name for name in ("one", "two", "stopped"))
        alone, together = _taken(one, 1), _taken(two, 2)
        _agree(two, one)
        ratio = together / alone
        note = f"{_proved(one)} of {_COUNT} proved; the same table and files"
        yield Row(_TOPIC, "two workers", "one worker", together, alone, *(ratio,) * 3, at_most=True, note=note)
        before = _killed(stopped)
        begun = time.perf_counter()
        _run(stopped, 2).wait()
        rest = time.perf_counter() - begun
        _agree(stopped, one)
        after = _written(stopped)
        again = sum(after[name] != when for name, when in before.items()) / len(before)
        row = Row(
            _TOPIC, "killed half-way and resumed: work done twice", f"{len(before)} rows", rest, alone, *(again,) * 3
        )
        yield replace(row, target=0.0, at_most=True, note="the same table and files as in one run")


def _taken(folder: Path, workers: int) -> float:
    begun = time.perf_counter()
    if _run(folder, workers).wait():
        raise RuntimeError(f"a run with {workers} workers failed")
    return time.perf_counter() - begun


def _killed(folder: Path) -> dict[str, int]:
    """Kill a run once it has written half of the rows, and return when each of them was written."""
    run = _run(folder, 1)
    while run.poll() is None and len(_written(folder)) < _KILLED_AT:
        time.sleep(0.01)
    run.send_signal(signal.SIGKILL)
    run.wait()
    return _written(folder)


def _run(folder: Path, workers: int) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "benchmarks.recordings.fleet", str(folder), str(workers)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL)


def _written(folder: Path) -> dict[str, int]:
    return {path.parent.name: path.stat().st_mtime_ns for path in folder.rglob("row.json")}


def _agree(folder: Path, wanted: Path) -> None:
    """Raises Disagreement where two folders do not hold the same files."""
    if _contents(folder) != _contents(wanted):
        raise Disagreement(f"{folder.name} and {wanted.name}: files differ")


def _contents(folder: Path) -> dict[str, bytes]:
    """All files but those that a killed run left half-written."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.suffix != ".tmp")
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def _proved(folder: Path) -> int:
    return (folder / "fleet.csv").read_text(encoding="utf-8").count(",proved,")


def learned(folder: Path, workers: int) -> Fleet:
    """Learn all recordings, with jitter and gaps, for a double integrator."""
    recordings = {f"run {i:03}": _recording(i) for i in range(_COUNT)}
    plant = integrator(1.2, 2.0, 3.0, 1 / _RATE)
    return learn_many(recordings, plant, SquaredExponential(), "recorded", folder=folder, workers=workers)


def _recording(seed: int) -> Samples:
    """Return a sine of some amplitude and period in noise; some leave the bounds."""
    draw = np.random.default_rng(seed)
    times = np.arange(0, _SPAN, 1 / _RATE)
    times = times[draw.random(len(times)) < _KEPT]
    times = times + draw.uniform(0, _JITTER, len(times))
    amplitude, period = draw.uniform(0.7, 1.3), draw.uniform(4.0, 6.0)
    noise = _NOISE * draw.standard_normal(len(times))
    return Samples(times, amplitude * np.sin(2 * np.pi * times / period) + noise)


if __name__ == "__main__":
    learned(Path(sys.argv[1]), int(sys.argv[2]))
