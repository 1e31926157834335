"""What many constraint times and many samples cost: time, and memory in a process of its own."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

from benchmarks.duel import Row, agree, duel
from benchmarks.loops.windows import integrator
from benchmarks.problems import PRIOR, example, irregular, likelihood, regular
from pipeline.published.scalar import scalar
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.samples import Samples
from trackably.learn import learn_reference
from trackably.learning.problem import Solution
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.polytopes import Interval

_FEWEST, _COUNTS = 100, (1_000, 10_000, 100_000, 1_000_000)
_SPAN = 2.0  # seconds
_FEW, _MANY = 1_000, (10_000, 100_000)
_LARGE, _LARGE_TIMES = 10_000, 100_000
_KERNELS = {"squared exponential": SquaredExponential(), "Matérn 5/2": Matern52()}
_BUDGETS = {
    ("squared exponential", 1_000): 4.0,
    ("squared exponential", 10_000): 60.0,
    ("Matérn 5/2", 1_000): 10.0,
    ("Matérn 5/2", 10_000): 120.0,
}  # seconds
_RATE, _PERIOD, _NOISE = 10.0, 5.0, 0.05  # of the recording: samples a second, seconds, unit of the position
_WITHIN, _BEYOND = 1.0, 1.3  # amplitudes: the position is bounded by 1.2
_GROWTH = 15.0  # times the time for ten times the samples
_ODD, _OTHERS, _SLOWER = 1_245, 2, 1.5
_THREADS = "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"


def rows() -> Iterator[Row]:
    """Constraint times, then samples of a likelihood, then many of both."""
    of = example("example1")

    def fit(count: int) -> float:
        found = best_solution(of.at_instants(count, _SPAN / count))
        assert isinstance(found, Solution)
        return found.objective

    for count in _COUNTS:
        agree(f"{count} times", fit(count), fit(_FEWEST), 1e-6)
        yield duel(
            "growth with constraint times",
            f"Example 1, {_grouped(count)} instants of state and input",
            f"own fit with {_FEWEST}",
            lambda count=count: fit(count),
            lambda: fit(_FEWEST),
            target=1.5,
            at_most=True,
        )
    few = irregular(_FEW)
    for n in _MANY:
        many = irregular(n)
        yield duel(
            "growth with n: likelihood and gradient",
            f"n = {_grouped(n)} at random times",
            f"own with n = {_grouped(_FEW)}",
            lambda samples=many: likelihood(samples),
            lambda: likelihood(few),
            rounds=3,
            at_most=True,
        )
    yield from _large()
    for kernel in _KERNELS:
        yield from _recorded(kernel)
    for kernel in _KERNELS:
        yield from _leaving(kernel)
    yield _busy()


@dataclass(frozen=True)
class Measured:
    """Seconds of wall clock and processor, the peak of resident memory [byte], l, and how many places were active."""

    clock: float
    processor: float
    peak: int
    objective: float
    active: int


def _alone(*arguments: str, environment: Mapping[str, str] = os.environ) -> Measured:
    """Measure in a process of its own."""
    command = [sys.executable, "-m", "benchmarks.growth", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return Measured(**json.loads(done.stdout))


@contextmanager
def _others_at_work(count: int) -> Iterator[None]:
    """Keep so many other processes busy inside the block."""
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for other in others:
            other.kill()
            other.wait()


def _busy() -> Row:
    """Learn with default settings while others work, beside one thread while they do not."""
    kernel = "squared exponential"
    defaults = {name: value for name, value in os.environ.items() if name not in _THREADS}
    one = _alone(kernel, str(_ODD), environment=defaults | dict.fromkeys(_THREADS, "1")).processor
    with _others_at_work(_OTHERS):
        default = _alone(kernel, str(_ODD), environment=defaults).processor
    problem = f"double integrator, 10 Hz, n = {_grouped(_ODD)}, default threads, {_OTHERS} other busy processes"
    row = Row("recordings learned and proved", problem, "one thread", default, one, *(default / one,) * 3)
    return replace(row, target=_SLOWER, at_most=True)


def _recorded(kernel: str) -> Iterator[Row]:
    """Learn a window of ten samples a second with its proof, from a thousand samples and from ten thousand."""
    found = {n: _alone(kernel, str(n)) for n in (_FEW, _LARGE)}
    for n, measured in found.items():
        yield _within_budget(kernel, n, measured, f"double integrator, 10 Hz, {kernel}, n = {_grouped(n)}")
    few, many = (found[n].processor for n in (_FEW, _LARGE))
    problem = f"double integrator, 10 Hz, {kernel}, n = {_grouped(_LARGE)}"
    row = Row("recordings learned and proved", problem, f"own with n = {_grouped(_FEW)}", many, few, *(many / few,) * 3)
    yield replace(row, target=_GROWTH, at_most=True)


def _leaving(kernel: str) -> Iterator[Row]:
    """The same from a signal that leaves its bounds in each period, on both sides."""
    for n in (_FEW, _LARGE):
        problem = f"double integrator, 10 Hz, {kernel}, n = {_grouped(n)}, amplitude {_BEYOND} within ±1.2"
        yield _within_budget(kernel, n, _alone(kernel, str(n), str(_BEYOND)), problem)


def _within_budget(kernel: str, n: int, measured: Measured, problem: str) -> Row:
    budget, taken = _BUDGETS[kernel, n], measured.processor
    note = f"{measured.active} bounds active; J = {measured.objective:.1f}; {measured.peak / 2**20:.0f} MiB"
    row = Row("recordings learned and proved", problem, f"{budget:g} s", taken, budget, *(taken / budget,) * 3)
    return replace(row, target=1.0, at_most=True, note=note)


def recorded(kernel: str, count: int, amplitude: float = _WITHIN) -> Measured:
    """Learn from a sine in noise: with the smaller amplitude it stays within its bounds, where noise does not."""
    times = np.arange(count) / _RATE
    noise = _NOISE * np.random.default_rng(0).standard_normal(count)
    samples = Samples(times, amplitude * np.sin(2 * np.pi * times / _PERIOD) + noise)
    plant = integrator(1.2, 2.0, 3.0, 1 / _RATE)
    clock, processor = perf_counter(), process_time()
    found = learn_reference(samples, plant, _KERNELS[kernel], (0.0, float(times[-1])), progress=False)
    taken = perf_counter() - clock, process_time() - processor
    return Measured(*taken, _peak(), found.objective, len(found.active_bounds))


def _large() -> Iterator[Row]:
    found = _alone()
    problem = f"n = {_grouped(_LARGE)} regular, {_grouped(_LARGE_TIMES)} instants"
    note = f"{found.clock:.0f} s by the clock; {found.active} constraints active; l = {found.objective:.1f}"
    seconds = Row("large constrained fit", problem, "one minute", found.processor, 60.0, *(found.processor / 60,) * 3)
    yield replace(seconds, target=1.0, at_most=True, note=note)
    part = found.peak / 2**30
    memory = Row("large constrained fit: peak memory", problem, "1 GiB", np.nan, np.nan, part, part, part)
    yield replace(memory, target=1.0, at_most=True, note=f"{found.peak / 2**20:.0f} MiB, libraries included")


def _grouped(count: int) -> str:
    return f"{count:,}".replace(",", " ")


def _peak() -> int:
    """The most memory [byte] that this process has held; getrusage would count what its parent held, too."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def measure(samples: int, times: int) -> Measured:
    """A constrained fit of regular samples, eight starts."""
    step = 0.01
    recorded = regular(samples, step)
    system = scalar(0.9, 0.5, state_set=Interval(-1.5, 1.0), input_set=Interval(-0.5, 0.5), sampling_time=step)
    space = SearchSpace.around((recorded,), PRIOR)
    of = replace(example("example1"), samples=recorded, prior=PRIOR, system=system, space=space)
    clock, processor = perf_counter(), process_time()
    found = best_solution(of.at_instants(times, samples * step / times))
    assert isinstance(found, Solution), found.explanation
    taken = perf_counter() - clock, process_time() - processor
    return Measured(*taken, _peak(), found.objective, sum(len(places) for places in found.active))


if __name__ == "__main__":
    match sys.argv[1:]:
        case [kernel, count, *amplitude]:
            print(json.dumps(vars(recorded(kernel, int(count), *map(float, amplitude)))))
        case _:
            print(json.dumps(vars(measure(_LARGE, _LARGE_TIMES))))
