"""What a certificate claims, and about which times."""

import math
from dataclasses import dataclass

import numpy as np

from trackably.gp.signal import KernelSum
from trackably.systems.polytopes import rounded
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class AllTimes:
    """Every real t ≥ 0: by boxes on [0, tail_start], and by a decaying envelope from `tail_start` [s] on."""

    tail_start: float

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last claimed time [s]."""
        return 0.0, math.inf

    def __str__(self) -> str:
        return "all real t ≥ 0"


@dataclass(frozen=True)
class AllPhases:
    """Every real t: by boxes on one `period` [s] (the exact value of the stored float64) of a periodic kernel."""

    period: float

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last claimed time [s]."""
        return -math.inf, math.inf

    def __str__(self) -> str:
        return "all real t"


@dataclass(frozen=True)
class OnWindow:
    """Every real t from `start` to `end` [s], and nothing about other times."""

    start: float
    end: float

    def __post_init__(self) -> None:
        if not self.start < self.end:
            raise ValueError(f"claim: a window needs start < end, got [{self.start!r}, {self.end!r}]")
        if not (math.isfinite(self.start) and math.isfinite(self.end)):
            raise ValueError(f"claim: a window needs finite ends, got [{self.start!r}, {self.end!r}]")

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last claimed time [s]."""
        return self.start, self.end

    def __str__(self) -> str:
        return f"all real t from {rounded(self.start, 'up', 6)} s to {rounded(self.end, 'down', 6)} s"


@dataclass(frozen=True)
class AtInstants:
    """Every instant k T_s, k = 0, 1, 2, …: one by one up to `last_step`, by a decaying envelope after it."""

    last_step: int

    @property
    def span(self) -> tuple[float, float]:
        """The first and the last claimed time [s]."""
        return 0.0, math.inf

    def __str__(self) -> str:
        return "all sampled instants k T_s, k ≥ 0"


Claim = AllTimes | AllPhases | OnWindow | AtInstants


def refuse_empty(reference: Reference) -> None:
    """Raise ValueError if there is nothing to prove: nothing is bounded, or a signal has no centres."""
    if not reference.quantities:
        raise ValueError("claim: nothing is bounded, so there is nothing to prove; give a state or an input bounds")
    for i, signal in enumerate(reference.signals):
        if isinstance(signal, KernelSum) and not len(signal.centres):
            raise ValueError(
                f"reference: signal z{i + 1} has no centres, so that it is the constant {signal.mean:g}: give it one "
                "centre, of weight 0, to prove its bounds"
            )


def latest_time(reference: Reference) -> float:
    """Return the largest |t| [s] of a centre, plus the longest shift of a signal."""
    latest = max(float(np.max(np.abs(signal.centres), initial=0.0)) for signal in reference.kernel_sums)
    return latest + max(reference.plant.flatness.orders) * reference.plant.sampling_time
