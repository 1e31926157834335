"""What was read: signals, each with its own times, since one origin."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from trackable.errors import InputError
from trackable.gp.samples import Samples
from trackable.recordings.cleaning import Cleaning
from trackable.recordings.origin import described
from trackable.recordings.signal import Signal


@dataclass(frozen=True)
class Recording:
    """`signals` by name, differently spaced as they may be, with times [s] since `origin`.

    `origin` [ns] is where their zero lies on the file's own clock, exactly: since 1970 for epoch stamps, dates and most
    log times, which are `absolute`, else since the file's zero. `cleanings` says, for each table or topic, what was
    found and mended.
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
        """What a Gaussian process learns from. InputError lists the signals where there is none of that name."""
        return self[name].samples()

    def select(self, start: float, end: float) -> "Recording":
        """The samples with start ≤ time ≤ end [s], same origin. InputError where a signal has none."""
        return replace(self, signals={name: _named(name, s, start, end) for name, s in self.signals.items()})

    def every(self, seconds: float) -> "Recording":
        """Fewer samples, roughly `seconds` apart, as `Signal.every` chooses them. InputError where not positive."""
        return replace(self, signals={name: signal.every(seconds) for name, signal in self.signals.items()})

    def beside(self, other: "Recording") -> "Recording":
        """The signals of both. InputError where origins differ or a name is in both: nothing is shifted or replaced."""
        if self.origin != other.origin:
            raise InputError(
                f"recordings have their zero at {self.origin} ns and {other.origin} ns; read both with the same origin"
            )
        if both := self.signals.keys() & other.signals.keys():
            raise InputError(f"both recordings have a signal {min(both)!r}; give one another name")
        signals, cleanings = {**self.signals, **other.signals}, self.cleanings + other.cleanings
        return Recording(signals, self.origin, cleanings, self.absolute and other.absolute)

    def __str__(self) -> str:
        lines = [
            f"{name}: {len(signal)} samples from {signal.times[0]:g} to {signal.times[-1]:g} s"
            for name, signal in self.signals.items()
        ]
        return "\n".join([*lines, f"time zero: {described(self.origin, self.absolute)}", *map(str, self.cleanings)])


def _named(name: str, signal: Signal, start: float, end: float) -> Signal:
    try:
        return signal.select(start, end)
    except InputError as error:
        raise InputError(f"{name!r}: {error}") from error
