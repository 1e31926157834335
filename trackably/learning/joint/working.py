"""A working set: of the places that a program has, those that hold the function back for some θ on the way.

A search meets hundreds of places; few are active at once. The covariance of the rows in the working set is much smaller
than that of all rows, and the function that they give is that of all places once it breaks no bound at the others.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from trackably.arrays import Flags
from trackably.gp.joint import JointPosterior
from trackably.learning.joint.bent import BentMean, bent_by
from trackably.learning.joint.places import Demands

_MISSED = 1e-9  # of a bound's width
_MAX_ROUNDS = 30


@dataclass
class WorkingSet:
    """The `demanded` rows, and those `chosen` so far, shape (r,). The set only grows: J stays smooth near a minimum.

    Rows that held the last function back are where the search for those of the next one begins.
    """

    demanded: Demands
    chosen: Flags
    _active: Flags | None = None
    _own: Demands | None = None
    """The chosen rows: the same object for every θ between which none is added, as it remembers its terms' order."""

    def bent(self, posterior: JointPosterior) -> BentMean | None:
        """Return the function that meets all demands. Raises IllConditioned."""
        for _ in range(_MAX_ROUNDS):
            rows = np.flatnonzero(self.chosen)
            likely = None if self._active is None else self._active[rows]
            self._own = self._own or self.demanded.among(rows)
            found = bent_by(posterior, self._own, likely)
            if found is None or found.contradicts:
                return found
            self._active = np.zeros_like(self.chosen)
            self._active[rows] = found.multipliers > 0
            added = self._missed(found)
            if not len(added):
                return found
            self.chosen[added], self._own = True, None
        return bent_by(posterior, self.demanded)

    def _missed(self, found: BentMean) -> npt.NDArray[np.intp]:
        """Return the rows outside the set that are missed, of neighbouring ones that which is missed most."""
        values = self.demanded.rows.values(found.given.signals(found.multipliers))
        missed = (self.demanded.limits - values) / self.demanded.widths
        rows = np.flatnonzero((missed > _MISSED) & ~self.chosen)
        runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
        return np.array([run[np.argmax(missed[run])] for run in runs if len(run)], dtype=np.intp)
