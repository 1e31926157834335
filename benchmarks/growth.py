"""Time, and memory in a separate process, for many constraint times, many samples and many recordings."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

import numpy as np

from benchmarks.harness import Disagreement, Row, agree, duel, grouped, in_new_process, part_of, within
from benchmarks.problems import PRIOR, integrator, regular, solved, task
from pipeline.published.scalar import scalar
from trackably import Samples, SquaredExponential, learn_many, learn_reference
from trackably.arrays import Array
from trackably.gp.kernels.matern import Matern52
from trackably.systems.intervals import Interval

_FEWEST, _COUNTS = 100, (1_000, 10_000, 100_000, 1_000_000)
_SPAN = 2.0  # seconds from the first constraint time to the last
_FEW, _LARGE, _LARGE_TIMES = 1_000, 10_000, 100_000
_KERNELS = {"squared exponential": SquaredExponential(), "Matérn 5/2": Matern52()}
_BUDGETS = {"squared exponential": {_FEW: 4.0, _LARGE: 60.0}, "Matérn 5/2": {_FEW: 10.0, _LARGE: 120.0}}  # seconds
_RATE, _PERIOD, _NOISE = 10.0, 5.0, 0.05  # of the recording: samples a second, seconds, unit of the position
_WITHIN, _BEYOND = 1.0, 1.3  # amplitudes: the position is bounded by 1.2
_GROWTH = 15.0  # target: most factor of the time for ten times as many samples
_ODD, _OTHERS, _SLOWER = 1_245, 2, 1.5
_THREADS = "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"
_PLANT = integrator(1.2, 2.0, 3.0, 1 / _RATE)
_RECORDED = "recordings learned and proved"
_FLEET, _SECONDS, _JITTER, _LEFT = 200, 6.0, 0.02, 0.9  # recordings; the part of the samples that is not lost


def rows() -> Iterator[Row]:
    """Yield rows for many constraint times, many samples, both, and one or two hundred recordings."""

    def fit(count: int) -> float:
        return solved(task("example1").at_instants(count, _SPAN / count)).objective

    for count in _COUNTS:
        yield duel(
            "growth with constraint times",
            f"Example 1, {grouped(count)} instants of state and input",
            f"own fit with {_FEWEST}",
            partial(fit, count),
            partial(fit, _FEWEST),
            target=1.5,
            at_most=True,
            check=lambda count=count: agree(f"{count} times", fit(count), fit(_FEWEST), 1e-6),
        )
    yield from _large()
    for kernel in _KERNELS:
        yield from _recordings(kernel)
    yield _busy()
    yield _two_workers()


@dataclass(frozen=True)
class Measured:
    """Seconds of wall clock and of the processor, the peak of resident memory [byte], and two numbers of the result.

    `objective` and `count` are the objective and the number of active constraints, or zero and the number of recordings
    that were proved.
    """

    clock: float
    processor: float
    peak: int
    objective: float
    count: int

    @classmethod
    def of(cls, run: Callable[..., tuple[float, int]], *arguments: Any) -> "Measured":
        """Run a function and measure it in this process.

        The peak of memory is not that of getrusage, which would include memory of the parent process.
        """
        clock, processor = perf_counter(), process_time()
        found = run(*arguments)
        taken = perf_counter() - clock, process_time() - processor
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
        peak = 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
        return cls(*taken, peak, *found)


def _alone(run: Callable[..., object], *arguments: object, environment: dict[str, str] | None = None) -> Measured:
    """Run and measure a function of this module in a new process."""
    call = f"growth.Measured.of(growth.{run.__name__}, *{arguments!r})"
    code = f"import json; from benchmarks import growth; print(json.dumps(vars({call})))"
    return Measured(**json.loads(in_new_process("-c", code, environment=environment)))


def _large() -> Iterator[Row]:
    found = _alone(constrained_fit, _LARGE, _LARGE_TIMES)
    problem = f"n = {grouped(_LARGE)} regular, {grouped(_LARGE_TIMES)} instants"
    note = f"{found.clock:.0f} s by the clock; {found.count} constraints active; l = {found.objective:.1f}"
    yield within("large constrained fit", problem, found.processor, 60.0, note)
    said = f"{found.peak / 2**20:.0f} MiB, libraries included"
    yield part_of("large constrained fit: peak memory", problem, "1 GiB", found.peak, 2**30, 1.0, said)


def _recordings(kernel: str) -> Iterator[Row]:
    """Yield rows for learning a window of ten samples a second with proof; signals keep or break their bounds."""
    seconds, system = {}, f"double integrator, 10 Hz, {kernel}"
    for amplitude in (_WITHIN, _BEYOND):
        leaving = "" if amplitude == _WITHIN else f", amplitude {amplitude} within ±1.2"
        for n, budget in _BUDGETS[kernel].items():
            found = _alone(learn_sine, kernel, n, amplitude)
            seconds[amplitude, n] = found.processor
            note = f"{found.count} bounds active; J = {found.objective:.1f}; {found.peak / 2**20:.0f} MiB"
            yield within(_RECORDED, f"{system}, n = {grouped(n)}{leaving}", found.processor, budget, note)
    many, few = seconds[_WITHIN, _LARGE], seconds[_WITHIN, _FEW]
    problem, rival = f"{system}, n = {grouped(_LARGE)}", f"own with n = {grouped(_FEW)}"
    yield part_of(_RECORDED, problem, rival, many, few, _GROWTH, in_seconds=True)


def _busy() -> Row:
    """Compare learning with default threads while other processes are busy, and with one thread while they are not."""
    arguments = learn_sine, "squared exponential", _ODD, _WITHIN
    defaults = {name: value for name, value in os.environ.items() if name not in _THREADS}
    one = _alone(*arguments, environment=defaults | dict.fromkeys(_THREADS, "1")).processor
    with ExitStack() as others:
        for _ in range(_OTHERS):
            other = others.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            others.callback(other.kill)
        default = _alone(*arguments, environment=defaults).processor
    problem = f"double integrator, 10 Hz, n = {grouped(_ODD)}, default threads, {_OTHERS} other busy processes"
    return part_of(_RECORDED, problem, "one thread", default, one, _SLOWER, in_seconds=True)


def learn_sine(kernel: str, count: int, amplitude: float) -> tuple[float, int]:
    """Learn from a noisy sine, which keeps its bounds only with the smaller amplitude; return objective and count."""
    times = np.arange(count) / _RATE
    samples = _noisy(times, amplitude, _PERIOD, np.random.default_rng(0))
    found = learn_reference(samples, _PLANT, _KERNELS[kernel], (0.0, float(times[-1])), progress=False)
    return found.objective, len(found.active_bounds)


def _noisy(times: Array, amplitude: float, period: float, draw: np.random.Generator) -> Samples:
    """Return samples of a sine with noise."""
    return Samples(times, amplitude * np.sin(2 * np.pi * times / period) + _NOISE * draw.standard_normal(len(times)))


def constrained_fit(count: int, times: int) -> tuple[float, int]:
    """Fit `count` regular samples from eight starts, with constraints at `times` times."""
    step = 0.01
    system = scalar(0.9, 0.5, state_set=Interval(-1.5, 1.0), input_set=Interval(-0.5, 0.5), sampling_time=step)
    of = replace(task("example1"), samples=(regular(count, step),), prior=PRIOR, plant=system, starts=8)
    found = solved(of.at_instants(times, count * step / times))
    return found.objective, sum(len(places) for places in found.active)


def _two_workers() -> Row:
    """Compare wall times of one worker and of two for two hundred recordings; both must write the same bytes."""
    found, contents = [], []
    with TemporaryDirectory() as folder:
        for workers in (2, 1):
            into = Path(folder, str(workers))
            found.append(_alone(learn_fleet, str(into), workers))
            files = (path for path in into.rglob("*.*") if path.is_file())
            contents.append({path.relative_to(into): path.read_bytes() for path in files})
    if contents[0] != contents[1]:
        raise Disagreement("one worker and two: files differ")
    note = f"{found[0].count} of {_FLEET} proved; the same table and files"
    names = f"{_FLEET} recordings learned and proved", "two workers", "one worker"
    return part_of(*names, *(of.clock for of in found), note=note, in_seconds=True)


def learn_fleet(folder: str, workers: int) -> tuple[float, int]:
    """Learn from noisy sines of several amplitudes and periods, with jitter and gaps; some break the bounds."""
    recordings = {f"run {i:03}": _recording(np.random.default_rng(i)) for i in range(_FLEET)}
    given = recordings, _PLANT, SquaredExponential(), "recorded"
    return 0.0, len(learn_many(*given, folder=Path(folder), workers=workers).proved)


def _recording(draw: np.random.Generator) -> Samples:
    times = np.arange(0, _SECONDS, 1 / _RATE)
    times = times[draw.random(len(times)) < _LEFT]
    times = times + draw.uniform(0, _JITTER, len(times))
    amplitude, period = draw.uniform(0.7, 1.3), draw.uniform(4.0, 6.0)
    return _noisy(times, amplitude, period, draw)
