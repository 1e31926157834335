"""A recording: named signals, each with its own times, with one common time origin."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from trackably.errors import InputError
from trackably.gp.samples import Samples
from trackably.recordings.cleaning import Cleaning
from trackably.recordings.origin import described
from trackably.recordings.signal import Signal
from trackably.systems.sets.interval import ends_shown


@dataclass(frozen=True)
class Recording:
    """`signals` by name, each with its own times [s] since the common `origin` [ns].

    The origin is exact, on the file's own clock. It is `absolute` if that clock counts from 1970, as epoch stamps,
    dates and most log times do. `cleanings` has a report of what was found and repaired for each table or topic.
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
        """Return the samples of a signal, to learn from. InputError: no signal has that name; it lists the names."""
        return self[name].samples()

    def select(self, start: float, end: float) -> "Recording":
        """Return the samples with start ≤ time ≤ end [s]; the origin stays. InputError: a signal has none there."""
        return replace(self, signals={name: _named(name, s, start, end) for name, s in self.signals.items()})

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
            f"{name}: {len(signal)} samples from {' to '.join(_span(signal))} s{_gaps(signal)}"
            for name, signal in self.signals.items()
        )
        return [*signals, f"time zero: {described(self.origin, self.absolute)}"]


def _span(signal: Signal) -> tuple[str, str]:
    return ends_shown(float(signal.times[0]), float(signal.times[-1]))


def _gaps(signal: Signal) -> str:
    """Return where the longest gap is and how many there are; nothing where there is none."""
    if not (gaps := signal.samples().gaps):
        return ""
    start, end = max(gaps, key=lambda gap: gap[1] - gap[0])
    others = f", the longest of {len(gaps)} such gaps" if len(gaps) > 1 else ""
    return f", none for {end - start:.4g} s after {start:.6g} s{others}"


def _named(name: str, signal: Signal, start: float, end: float) -> Signal:
    try:
        return signal.select(start, end)
    except InputError as error:
        raise InputError(f"{name!r}: {error}") from error
