"""Long matrices of covariances, evaluated only where two times are within the kernel's reach of each other."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array

Places = npt.NDArray[np.intp]

_SHORT = 2**18  # entries: for fewer, one call is as fast as several
_PARTS = 4  # a reach is long if the times span less than that many of it


class Nearby(NamedTuple):
    """Places of a first array of times that are close to each other, and those of a second one within reach of them."""

    first: Places
    second: Places


def nearby(first: Array, second: Array, reach: float) -> list[Nearby] | None:
    """Return all pairs of places, group by group, whose times [s] are within `reach` [s]: shapes (m,) and (n,).

    The groups also hold some pairs that lie further apart. None where it would save nothing: for short arrays, and for
    a long reach.
    """
    if len(first) * len(second) < _SHORT or not _PARTS * reach < np.ptp(first):
        return None
    return list(_groups(first, second, reach))


def assembled(groups: list[Nearby], shape: tuple[int, int], entries: Callable[[Places, Places], Array]) -> Array:
    """Return the matrix with these `entries` in all groups, and zeros elsewhere."""
    found = np.zeros(shape)
    for of_first, of_second in groups:
        found[np.ix_(of_first, of_second)] = entries(of_first, of_second)
    return found


def _groups(first: Array, second: Array, reach: float) -> Iterator[Nearby]:
    """Divide the first times into groups half as long as the reach."""
    in_order, other_order = np.argsort(first, kind="stable"), np.argsort(second, kind="stable")
    times, others = first[in_order], second[other_order]
    group = np.floor((times - times[0]) / (reach / 2))
    for part in np.split(np.arange(len(times)), np.flatnonzero(np.diff(group)) + 1):
        lower, upper = np.searchsorted(others, [times[part[0]] - reach, times[part[-1]] + reach]).tolist()
        yield Nearby(in_order[part], other_order[lower:upper])
