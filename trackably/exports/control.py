"""References as trajectories of python-control, which is not imported: signals in rows, times in columns."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from trackably.arrays import Array, ArrayLike
from trackably.exports.proved import Proved, chosen_steps, proved_times


@dataclass(frozen=True, eq=False)
class TimeResponse:
    """States (n, N), inputs (m, N) and outputs (all states) at N times [s].

    Attributes have the names of python-control's `TimeResponseData`.
    """

    time: Array
    states: Array
    inputs: Array
    state_labels: list[str]
    input_labels: list[str]

    @property
    def outputs(self) -> Array:
        """The states: a reference has no other outputs."""
        return self.states

    def __iter__(self) -> Iterator[Array]:
        return iter((self.time, self.outputs))


@dataclass(frozen=True, eq=False)
class FlatTrajectory:
    """A reference with the methods `eval` and `response` of `control.flatsys.SystemTrajectory`."""

    proved: Proved

    def eval(self, tlist: ArrayLike) -> tuple[Array, Array]:
        """Return states (n, N) and inputs (m, N) at N times [s]; angles do not jump between them.

        ValueError: a time is not proved.
        """
        t = np.atleast_1d(proved_times(self.proved, tlist))
        reference = self.proved.reference
        return reference.plant.unwrap(reference.state_at(t)).T, reference.input_at(t).T

    def response(self, timepts: ArrayLike | None = None) -> TimeResponse:
        """Return states and inputs at times [s], by default at the steps that `plot` shows.

        `input_output_response(system, *…)` needs times that are steps of the system. ValueError as `eval`.
        """
        reference = self.proved.reference
        t = reference.instants(chosen_steps(self.proved, None, None)) if timepts is None else timepts
        states, inputs = self.eval(t)
        system = reference.plant.system
        return TimeResponse(np.atleast_1d(np.asarray(t)), states, inputs, [*system.states], [*system.inputs])
