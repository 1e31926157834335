"""One signal of a recording."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from trackably.arguments import is_number, numbers
from trackably.arrays import Array
from trackably.errors import InputError
from trackably.gp.samples import Samples


@dataclass(frozen=True)
class Signal:
    """`values` at strictly increasing `times` [s], both of shape (n,), n ≥ 1.

    `noise_std` (n,) is the standard deviation of each sample, in the unit of the values; None if it is not known.
    Raises ValueError, which names the first wrong entry: shapes, order, or numbers that are not finite or positive.
    """

    times: Array
    values: Array
    noise_std: Array | None = None

    def __post_init__(self) -> None:
        samples = Samples(self.times, self.values)
        object.__setattr__(self, "times", samples.times)
        object.__setattr__(self, "values", samples.values)
        if self.noise_std is not None:
            noise_std = numbers("signal: noise_std", self.noise_std)
            if noise_std.shape != samples.times.shape:
                raise ValueError(f"signal: noise_std must be as long as the times, got shape {noise_std.shape}")
            if bad := np.flatnonzero(~((noise_std > 0) & np.isfinite(noise_std))).tolist():
                raise ValueError(f"signal: noise_std[{bad[0]}] must be positive, got {noise_std[bad[0]]}")
            noise_std.flags.writeable = False
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

        After each sample follows the one nearest to `seconds` later, and at least half of it later. Gaps stay gaps, and
        thinning again by the same time changes nothing. InputError: `seconds` is not positive and finite.
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
