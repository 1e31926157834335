"""A recording: named samples, each with their own times, one common time origin, and a report of repairs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from trackably.arguments import numbers
from trackably.errors import InputError
from trackably.gp.samples import Samples
from trackably.recordings.clocks import describe_origin
from trackably.systems.intervals import ends_shown


@dataclass(frozen=True)
class Finding:
    """One kind of error in a file, and its repair: `what` describes both.

    The error is in `count` rows or values; `first` is the place of the first one.
    """

    what: str
    count: int
    first: str

    def __str__(self) -> str:
        return f"{self.what}: {self.count}, first in {self.first}"


@dataclass(frozen=True)
class Cleaning:
    """A report for printing: the errors that were found in a file or topic, the `source`, and their repairs.

    `rows` is the number of rows that were read. Without errors, there are no `findings`.
    """

    source: str
    rows: int
    findings: tuple[Finding, ...] = ()

    def __str__(self) -> str:
        found = [str(finding) for finding in self.findings] or ["nothing to mend"]
        return "\n  ".join([f"{self.source}: {self.rows} rows", *found])


@dataclass(frozen=True)
class Recording:
    """`signals` by name: samples, each with their own times [s] since the common `origin` [ns].

    The origin is exact, on the file's own clock. The recording is `absolute` if that clock counts from 1970, as epoch
    stamps, dates and most log times do. `cleanings` are the reports of errors and repairs for each table or topic.
    """

    signals: Mapping[str, Samples]
    origin: int
    cleanings: tuple[Cleaning, ...] = ()
    absolute: bool = False

    def __getitem__(self, name: str) -> Samples:
        return self.samples(name)

    def samples(self, name: str) -> Samples:
        """Return the samples of a signal, to learn from. InputError, which lists the names: no signal has this name."""
        if name not in self.signals:
            raise InputError(f"the recording has no signal {name!r}; it has {', '.join(self.signals)}")
        return self.signals[name]

    def select(self, start: float, end: float) -> "Recording":
        """Return the samples with start ≤ time ≤ end [s]; the origin stays. InputError: a signal has none there."""
        return replace(self, signals={name: select(repr(name), of, start, end) for name, of in self.signals.items()})

    def __repr__(self) -> str:
        return f"Recording({'; '.join(self._contents())})"

    def __str__(self) -> str:
        return "\n".join([*self._contents(), *map(str, self.cleanings)])

    def _contents(self) -> list[str]:
        """Return a line for each signal, and one for the origin."""
        signals = (
            f"{name}: {len(of)} samples from {' to '.join(ends_shown(*of.times[[0, -1]].tolist()))} s{_gaps(of)}"
            for name, of in self.signals.items()
        )
        return [*signals, f"time zero: {describe_origin(self.origin, self.absolute)}"]


def select(what: str, samples: Samples, start: float, end: float) -> Samples:
    """Return the samples with start ≤ time ≤ end [s]. InputError, which begins with `what`: there is none."""
    start, end = numbers("select: start and end", [start, end]).tolist()
    chosen = np.flatnonzero((samples.times >= start) & (samples.times <= end))
    if chosen.size == 0:
        first, last = samples.times[[0, -1]]
        raise InputError(
            f"{what}: no sample lies in [{start:g}, {end:g}] s; there are samples from {first:g} to {last:g} s"
        )
    return samples.only(chosen)


def _gaps(samples: Samples) -> str:
    """Return a text about the longest gap in the times and the number of gaps; "" if there are none."""
    if not (gaps := samples.gaps):
        return ""
    start, duration = gaps[0]
    others = f", the longest of {len(gaps)} such gaps" if len(gaps) > 1 else ""
    return f", none for {duration:.4g} s after {start:.6g} s{others}"
