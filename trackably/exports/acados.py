"""References for acados: yref of each stage and yref_e of the last, for the horizon at each step."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from trackably.arguments import whole
from trackably.arrays import Array
from trackably.exports.proved import Proved, proved_times


class StageReferences(NamedTuple):
    """`yref` of stages 0 … N − 1, shape (N, n + m): states, then inputs. `yref_e` of stage N, shape (n,): states."""

    yref: Array
    yref_e: Array


@dataclass(frozen=True, eq=False)
class SlidingReferences:
    """References of a solver with N = `horizon` stages of one sampling time each, for costs of type `LINEAR_LS`.

    The output y = Vx x + Vu u has to be (x, u): Vx = [I; 0] and Vu = [0; I], and at the end Vx_e = I.
    """

    proved: Proved
    horizon: int

    def at(self, k: int, state: Array | None = None) -> StageReferences:
        """Return the references of all stages for a controller at step k: stage j is step k + j.

        Angles do not jump. If the plant's `state` (n,) is given, whole turns are added to bring them near its angles.
        ValueError: a step from k to k + N is not proved.
        """
        k = whole("to_acados: k", k)
        reference = self.proved.reference
        steps = k + np.arange(self.horizon + 1.0)
        proved_times(self.proved, reference.instants(steps), steps)
        states, inputs = reference.window(k, self.horizon)
        if state is not None:
            states = reference.plant.unwrap(states, state)
        return StageReferences(np.concatenate([states[:-1], inputs], axis=-1), states[-1])

    def set_in(self, solver: Any, k: int, state: Array | None = None) -> None:
        """Set the references at step k in an `AcadosOcpSolver`; call it once before each `solve`.

        `state` and ValueError as in `at`.
        """
        stages = self.at(k, state)
        for stage, yref in enumerate(stages.yref):
            solver.set(stage, "yref", yref)
        solver.set(self.horizon, "yref", np.asarray(stages.yref_e))
