"""A recording: named signals, each with its own times, one common time origin, and a report of repairs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from trackably.arguments import array, is_number
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.gp.samples import Samples
from trackably.recordings.clocks import describe_origin
from trackably.systems.intervals import ends_shown


@dataclass(frozen=True)
class Finding:
    """A kind of error and its repair, both in `what`, that concerns `count` rows or values, the
    first of which is `first`.

    Readers warn of a finding that `is_doubtful`: its repair may be wrong.
    """

    what: str
    count: int
    first: str
    is_doubtful: bool = False

    def __str__(self) -> str:
        return f"{self.what}: {self.count}, first in {self.first}"


@dataclass(frozen=True)
class Cleaning:
    """The findings in the `rows` (a number) of the file or topic `source`, for printing.

    None if there were no errors.
    """

    source: str
    rows: int
    findings: tuple[Finding, ...] = ()

    @property
    def questions(self) -> list[str]:
        """The sentences of which readers warn."""
        return [f"{self.source}: {finding}" for finding in self.findings if finding.is_doubtful]

    def __str__(self) -> str:
        found = [str(finding) for finding in self.findings] or ["nothing to mend"]
        return "\n  ".join([f"{self.source}: {self.rows} rows", *found])


@dataclass(frozen=True)
class Signal:
    """`values` at strictly increasing `times` [s], both of shape (n,), n ≥ 1.

    `noise_std` (n,) is the standard deviation of each sample, in the unit of the values; None if it is not known.
    ValueError, which names the first wrong entry: shapes or order are wrong, or numbers are not finite or positive.
    """

    times: Array
    values: Array
    noise_std: Array | None = None

    def __post_init__(self) -> None:
        samples = Samples(self.times, self.values)
        object.__setattr__(self, "times", samples.times)
        object.__setattr__(self, "values", samples.values)
        if self.noise_std is not None:
            noise_std = array("signal: noise_std", self.noise_std, len(samples.times))
            if bad := np.flatnonzero(noise_std <= 0).tolist():
                raise ValueError(f"signal: noise_std[{bad[0]}] must be positive, got {noise_std[bad[0]]}")
            object.__setattr__(self, "noise_std", noise_std)

    def __len__(self) -> int:
        return self.times.size

    def __repr__(self) -> str:
        return repr(self.samples()).replace("Samples", "Signal", 1)

    def samples(self) -> Samples:
        """Return samples to learn from; `noise_std`, if known, is their `relative_noise`, for noise_std = 1."""
        if self.noise_std is None:
            return Samples(self.times, self.values)
        return Samples(self.times, self.values, self.noise_std)

    def select(self, start: float, end: float) -> "Signal":
        """Return the samples with start ≤ time ≤ end [s]. InputError: there is none."""
        for what, given in (("start", start), ("end", end)):
            if not is_number(given):
                raise InputError(f"select: {what}: expected a time in seconds, got {given!r}")
        chosen = np.flatnonzero((self.times >= start) & (self.times <= end))
        if chosen.size == 0:
            raise InputError(
                f"no sample lies in [{start:g}, {end:g}] s; there are samples from {self.times[0]:g} to "
                f"{self.times[-1]:g} s"
            )
        return self._only(chosen)

    def every(self, seconds: float) -> "Signal":
        """Thin out to samples about `seconds` apart.

        Each sample is followed by the one nearest to `seconds` later, among those at least half of it later. Gaps are
        kept, and thinning again by the same time changes nothing. InputError: `seconds` is not positive and finite.
        """
        if not (is_number(seconds) and 0 < seconds < np.inf):
            raise InputError(f"expected a time between samples above 0 s, got {seconds!r} s")
        chosen = [0]
        while True:
            due = self.times[chosen[-1]] + seconds
            first = max(int(np.searchsorted(self.times, due - seconds / 2)), chosen[-1] + 1)
            if first >= len(self):
                return self._only(np.array(chosen))
            after = max(int(np.searchsorted(self.times, due)), first)
            nearest = min(
                range(max(after - 1, first), min(after + 1, len(self))), key=lambda i: abs(self.times[i] - due)
            )
            chosen.append(nearest)

    def _only(self, chosen: npt.NDArray[np.intp]) -> "Signal":
        noise_std = None if self.noise_std is None else self.noise_std[chosen]
        return Signal(self.times[chosen], self.values[chosen], noise_std)


@dataclass(frozen=True)
class Recording:
    """`signals` by name, each with its own times [s] since the common `origin` [ns].

    The origin is exact, on the file's own clock. It is `absolute` if that clock counts from 1970, as epoch stamps,
    dates and most log times do. `cleanings` are the reports of errors and repairs for each table or topic.
    """

    signals: Mapping[str, Signal]
    origin: int
    cleanings: tuple[Cleaning, ...] = ()
    absolute: bool = False

    def __getitem__(self, name: str) -> Signal:
        if name not in self.signals:
            raise InputError(f"the recording has no signal {name!r}; it has {', '.join(self.signals)}")
        return self.signals[name]

    def samples(self, name: str) -> Samples:
        """Return the samples of a signal, to learn from. InputError, which lists the names: no signal has this name."""
        return self[name].samples()

    def select(self, start: float, end: float) -> "Recording":
        """Return the samples with start ≤ time ≤ end [s]; the origin stays. InputError: a signal has none there."""
        return replace(self, signals={name: _by_name(name, s, start, end) for name, s in self.signals.items()})

    def every(self, seconds: float) -> "Recording":
        """Thin out each signal to samples about `seconds` apart: see `Signal.every`."""
        return replace(self, signals={name: signal.every(seconds) for name, signal in self.signals.items()})

    def beside(self, other: "Recording") -> "Recording":
        """Return one recording with the signals of both. InputError: the origins differ, or a name is in both."""
        if self.origin != other.origin:
            raise InputError(
                f"recordings have their zero at {self.origin} ns and {other.origin} ns; read both with the same origin"
            )
        if both := self.signals.keys() & other.signals.keys():
            raise InputError(f"both recordings have a signal {min(both)!r}; give one another name")
        signals, cleanings = {**self.signals, **other.signals}, self.cleanings + other.cleanings
        return Recording(signals, self.origin, cleanings, self.absolute and other.absolute)

    def __repr__(self) -> str:
        return f"Recording({'; '.join(self._contents())})"

    def __str__(self) -> str:
        return "\n".join([*self._contents(), *map(str, self.cleanings)])

    def _contents(self) -> list[str]:
        """Return a line for each signal, and one for the origin."""
        signals = (
            f"{name}: {len(signal)} samples from {' to '.join(ends_shown(*signal.times[[0, -1]].tolist()))} s"
            f"{_gaps(signal)}"
            for name, signal in self.signals.items()
        )
        return [*signals, f"time zero: {describe_origin(self.origin, self.absolute)}"]


def _gaps(signal: Signal) -> str:
    """Return a text on the longest gap and the number of gaps; "" if there is none."""
    if not (gaps := signal.samples().gaps):
        return ""
    start, end = max(gaps, key=lambda gap: gap[1] - gap[0])
    others = f", the longest of {len(gaps)} such gaps" if len(gaps) > 1 else ""
    return f", none for {end - start:.4g} s after {start:.6g} s{others}"


def _by_name(name: str, signal: Signal, start: float, end: float) -> Signal:
    try:
        return signal.select(start, end)
    except InputError as error:
        raise InputError(f"{name!r}: {error}") from error
