"""What the generate stage writes: samples to learn from, and samples held out to compare with."""

from dataclasses import dataclass

from trackable.gp.samples import Samples


@dataclass(frozen=True)
class Sampled:
    """`samples` of the states `names`, in the order of the flat outputs, and later samples `held_out` of some of them.

    `held_out` has one entry for each of `held_out_names`.
    """

    names: tuple[str, ...]
    samples: tuple[Samples, ...]
    held_out_names: tuple[str, ...] = ()
    held_out: tuple[Samples, ...] = ()

    @property
    def only(self) -> Samples:
        """Return the samples where there is one flat output; ValueError where there are several."""
        (samples,) = self.samples
        return samples

    @property
    def by_name(self) -> dict[str, Samples]:
        return dict(zip(self.names, self.samples, strict=True))

    @property
    def held_out_by_name(self) -> dict[str, Samples]:
        return dict(zip(self.held_out_names, self.held_out, strict=True))
