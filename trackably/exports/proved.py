"""What an export needs of a reference: its values, and the proof that says at which times they may be used."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import Certificate
from trackably.gp.samples import Samples
from trackably.systems.reference import Reference


class Proved(Protocol):
    """A `reference`, the `certificate` that it keeps its bounds, and what it was learned from, by name of the state."""

    @property
    def reference(self) -> Reference: ...

    @property
    def certificate(self) -> Certificate: ...

    @property
    def explanation(self) -> str: ...

    @property
    def sampled(self) -> Mapping[str, Samples]: ...


def proved_times(proved: Proved, times: ArrayLike) -> Array:
    """Return times t [s] as an array of float64, of any shape.

    Raises TypeError where they are no numbers, and ValueError for times outside of what is proved.
    """
    t = numbers("times", times)
    if (found := proved.certificate.first_unproved(t)) is not None:
        i, why = found
        raise ValueError(f"t = {t.flat[i]:g} s is {why}; `reference.reference` has values there, without any guarantee")
    return t


def proved_steps(proved: Proved, first: int, count: int) -> Array:
    """Return the steps k = `first`, …, `first` + `count` − 1. Raises ValueError for steps outside of what is proved."""
    k = whole("first", first) + np.arange(float(whole("count", count, least=1)))
    proved_times(proved, proved.reference.instants(k))
    return k
