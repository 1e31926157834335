"""References as trajectories of python-control, which is not imported: signals in rows, times in columns."""

from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array, ArrayLike
from trackably.exports.proved import Proved, proved_times


@dataclass(frozen=True, eq=False)
class FlatTrajectory:
    """A reference with the method `eval` of `control.flatsys.SystemTrajectory`."""

    proved: Proved

    def eval(self, tlist: ArrayLike) -> tuple[Array, Array]:
        """Return states (n, N) and inputs (m, N) at N times [s]; angles do not jump between them.

        ValueError: a time is not proved.
        """
        t = np.atleast_1d(proved_times(self.proved, tlist))
        reference = self.proved.reference
        return reference.plant.unwrap(reference.state_at(t)).T, reference.input_at(t).T
