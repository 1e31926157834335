"""What the generate stage writes: samples to learn from, and samples held out to compare with."""

from collections.abc import Sequence
from dataclasses import dataclass

from trackably.arrays import Array
from trackably.gp.samples import Samples
from trackably.systems.signals.signal import Signal


@dataclass(frozen=True)
class Sampled:
    """`samples` of the states `names`, in the order of the flat outputs, and later samples `held_out` of some of them.

    Samples of several names that show one flat output are together, under the first of them. `held_out` has one entry
    for each of `held_out_names`.
    """

    names: tuple[str, ...]
    samples: tuple[Samples, ...]
    held_out_names: tuple[str, ...] = ()
    held_out: tuple[Samples, ...] = ()

    @property
    def only(self) -> Samples:
        """Return the samples where there is one flat output, those that show where it is; ValueError: several are."""
        (samples,) = self.samples
        return samples.of_level

    @property
    def by_name(self) -> dict[str, Samples]:
        """The samples of each name; several names may show one flat output."""
        flat = zip(self.names, self.samples, strict=True)
        return {name: of for first, together in flat for name, of in together.by_name(first).items()}

    def mean_squares(self, signals: Sequence[Signal]) -> dict[str, float]:
        """Return the mean of squares of samples minus what these flat outputs give in their place, by name."""
        return {
            name: of.mean_square(of.values - self.measured(name, signals, of.times))
            for name, of in self.by_name.items()
        }

    def measured(self, name: str, signals: Sequence[Signal], t: Array) -> Array:
        """Return what samples of this name would be at times t [s] if the flat outputs were these, without noise."""
        for first, together, signal in zip(self.names, self.samples, signals, strict=True):
            if of := together.by_name(first).get(name):
                return of.stencil.measured(signal, t)
        raise ValueError(f"there are no samples of {name}")

    @property
    def held_out_by_name(self) -> dict[str, Samples]:
        return dict(zip(self.held_out_names, self.held_out, strict=True))
