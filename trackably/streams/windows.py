"""Learn one reference from many windows: each window adds kernels to the reference of all earlier ones.

Given samples y₁, the posterior mean is g₁ = m + Σ_i c_i κ(·, t_i). Given later samples y₂ too, it is g₁ + δ. Here δ is
the posterior mean of a process with prior mean zero, given zeros in place of y₁, and y₂ − g₁ in place of y₂; its
covariance is the same, because covariances do not depend on values. Only zeros within the kernel's memory matter.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from trackably.certificates.certificate import Certificate
from trackably.certificates.certified import constraints_at
from trackably.certificates.prove import Outcome, prove
from trackably.checker.certificate import Claim, Window
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples, recorded_span
from trackably.gp.signal import KernelSum
from trackably.learning.joint.search import learn_function
from trackably.learning.problem import ConstrainedProblem, NoSolution, Solution
from trackably.learning.space import SearchSpace
from trackably.reference.waypoints import Waypoint
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference
from trackably.work import done


def part_of(samples: Samples, start: float, end: float) -> Samples | None:
    """Return the samples with start ≤ time < end [s]; None if there are none.

    If the samples replace more recorded ones, the statistics of these (`scatters`) are left out, because they describe
    the whole recording.
    """
    at = np.flatnonzero((start <= samples.times) & (samples.times < end))
    return samples.only(at) if len(at) else None


def with_memory(samples: Samples, base: KernelSum, since: float, now: float, end: float) -> Samples | None:
    """Return the samples with since ≤ time < end [s]; before `now`, their values are replaced by those of `base`.

    If there are no such samples, return the last sample before `since` instead. None if no sample lies before `end`.
    """
    earlier = samples.times[samples.times < since]
    found = part_of(samples, since, end) or (part_of(samples, earlier[-1], end) if len(earlier) else None)
    if found is None:
        return None
    values = np.where(found.times < now, found.stencil.measured(base, found.times), found.values)
    return replace(found, values=values)


_MEMORY = 12.0  # correlation times: samples older than this change a function by less than 1/1000 of the noise
_SHORTEST = 1.0  # correlation times: windows whose program is too large are divided into parts of at least this length
BACKOFFS = 1e-5, 1e-4, 1e-3, 1e-2  # of a bound's width: how much it is tightened, so that a proof has room


@dataclass(frozen=True)
class Stream:
    """All `samples` of the flat outputs of a `plant`, with a `prior` whose hyperparameters are known.

    Windows have a `length` [s]; the first begins with the first sample. `claim` says at which times the whole
    reference is proved, and `pinned` are the required values at given times.
    """

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem
    length: float
    claim: Claim
    pinned: tuple[Waypoint, ...] = ()

    @property
    def memory(self) -> float:
        """The time [s] after which samples hardly matter any more, and after which a function has come to rest."""
        return _MEMORY * max(part.kernel.correlation_time for part in self.prior.parts)

    @property
    def windows(self) -> Iterator[tuple[float, float]]:
        """The first time of each window, and the first time after it [s]; the last window contains the last sample."""
        first, last = recorded_span(self.samples)
        count = max(1, int(np.ceil((last - first) / self.length)))
        ends = [first + i * self.length for i in range(count)]
        yield from zip(ends, [*ends[1:], float(np.nextafter(last, np.inf))], strict=True)


def learn_proved(stream: Stream) -> Outcome | NoSolution:
    """Return the proof of a reference that is learned from all windows, or the reason why there is none.

    If the proof fails, all windows are learned again with a larger back-off.
    """
    outcome: Outcome | None = None
    for backoff in BACKOFFS:
        signals = _signals(stream, backoff)
        if isinstance(signals, NoSolution):
            return outcome or signals
        outcome = prove(Reference(signals, stream.plant), stream.claim)
        done("fit")
        if isinstance(outcome, Certificate):
            break
    assert outcome is not None, "some back-off was tried"
    return outcome


def _signals(stream: Stream, backoff: float) -> tuple[KernelSum, ...] | NoSolution:
    """Return the signals learned from all windows in turn, with bounds tightened by `backoff`, a part of their width.

    Each window has a solution, because adding nothing keeps the bounds. The program of a rough function may need too
    many places (times at which it imposes a bound); then the window is divided. If that does not help, return why.
    """
    signals = tuple(KernelSum(part.kernel, part.mean, np.empty(0), np.empty(0)) for part in stream.prior.parts)
    shortest = _SHORTEST * stream.memory / _MEMORY
    windows = list(stream.windows)[::-1]
    while windows:
        now, end = windows.pop()
        problem = _problem(stream, signals, now, end, backoff)
        if problem is None:
            continue
        found = learn_function(problem)
        if isinstance(found, Solution):
            signals = found.signals
        elif end - now > 2 * shortest:
            windows += [((now + end) / 2, end), (now, (now + end) / 2)]
        else:
            return found
    return signals


def _problem(
    stream: Stream, bases: tuple[KernelSum, ...], now: float, end: float, backoff: float
) -> ConstrainedProblem | None:
    """Return the problem of the window from `now` to `end` [s].

    None if no flat output has samples in the window, or if some flat output has no samples before the end of the
    window. A flat output without samples in the window is continued from earlier samples, as far as bounds allow.
    Bounds are imposed from the earliest time at which a change has an effect, until the function is at rest.
    """
    memory = stream.memory
    if all(part_of(of, now, end) is None for of in stream.samples):
        return None
    every = (with_memory(of, base, now - memory, now, end) for of, base in zip(stream.samples, bases, strict=True))
    given = tuple(of for of in every if of is not None)
    if len(given) < len(bases):
        return None
    earliest = stream.claim.span[0]
    until = recorded_span(given)[1] + memory + stream.plant.sampling_time
    times = Window(max(min(earliest, now), now - 2 * memory), until)
    constraints = constraints_at(times, stream.plant, backoff, {})
    space = SearchSpace.around(given, stream.prior, starts=1)
    # Required values at the `times` at which bounds are imposed. Those before the first sample count as if
    # they were at its time, and those after the last sample likewise.
    first, last = recorded_span(stream.samples)
    within = (at for at in stream.pinned if times.start <= min(max(at.time, first), last) <= times.end)
    required = tuple(value for at in within for value in at.required_values(stream.plant))
    return ConstrainedProblem(given, stream.prior, space, constraints, required, bases=bases)
