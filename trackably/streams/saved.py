"""What is saved of a stream: all that it was learned from; its proof is found again when it is read."""

from dataclasses import dataclass, field

from trackably.certificates.goal import Claim
from trackably.certificates.pinned import Pinned
from trackably.condensed.cost import Condensation
from trackably.files import LEFT_OUT
from trackably.gp.joint import JointPrior
from trackably.gp.samples import Samples
from trackably.saved import Saved, SavedTightening
from trackably.streams.windows import Stream
from trackably.systems.reference import Reference


@dataclass(frozen=True, eq=False)
class SavedStream(Saved):
    """A reference `learned` in windows of a `length` [s], with the times of its proof. ValueError: parts do not fit."""

    learned: Reference
    samples: tuple[Samples, ...]
    prior: JointPrior
    length: float
    proved_from: float | None
    proved_until: float | None
    condensed: tuple[Condensation, ...] = field(default=(), metadata={LEFT_OUT: True})
    tightening: SavedTightening | None = field(default=None, metadata={LEFT_OUT: True})
    pinned: tuple[Pinned, ...] = field(default=(), metadata={LEFT_OUT: True})

    def __post_init__(self) -> None:
        super().__post_init__()
        counts = {len(self.samples), len(self.prior.parts), len(self.learned.kernel_sums)}
        if len(counts) > 1 or self.prior.learned or not self.length > 0:
            raise ValueError("stream: expected samples, a known prior and a signal of each flat output, and a length")

    @property
    def reference(self) -> Reference:
        return self.learned

    @property
    def stream(self) -> Stream:
        """What the reference was learned from."""
        start, end = self.proved_from, self.proved_until
        claim: Claim = "all_times" if start is None or end is None else (start, end)
        return Stream(self.samples, self.prior, self.learned.plant, self.length, claim, self.pinned)
