"""What the generate stage hands on: samples to learn from, and those kept back to see how far the learned goes."""

from dataclasses import dataclass

from trackable.gp.samples import Samples


@dataclass(frozen=True)
class Sampled:
    """`samples` by the `names` of what is sampled, in the order of the flat outputs; `held_out` follow them in time.

    Nothing is held out of what has no entry there: names are those of `held_out_names`.
    """

    names: tuple[str, ...]
    samples: tuple[Samples, ...]
    held_out_names: tuple[str, ...] = ()
    held_out: tuple[Samples, ...] = ()

    @property
    def only(self) -> Samples:
        """The samples of a scalar system."""
        (samples,) = self.samples
        return samples

    @property
    def by_name(self) -> dict[str, Samples]:
        return dict(zip(self.names, self.samples, strict=True))

    @property
    def held_out_by_name(self) -> dict[str, Samples]:
        return dict(zip(self.held_out_names, self.held_out, strict=True))
