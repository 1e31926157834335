"""References for acados: yref of each stage and yref_e of the last, and how they slide along."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from trackably.arguments import whole
from trackably.arrays import Array
from trackably.control.angles import unwrap_near
from trackably.exports.proved import Proved, proved_steps


class Solver(Protocol):
    """What is used of an `AcadosOcpSolver`."""

    def set(self, stage: int, field: str, value: Array, /) -> None: ...


class StageReferences(NamedTuple):
    """`yref` of stages 0 … N − 1, shape (N, n + m): states, then inputs. `yref_e` of stage N, shape (n,): states."""

    yref: Array
    yref_e: Array


@dataclass(frozen=True, eq=False)
class SlidingReferences:
    """References of a solver with N = `horizon` stages of one sampling time each, for the costs of `LINEAR_LS` type.

    There y = Vx x + Vu u is to be (x, u): Vx = [I; 0] and Vu = [0; I], and at the end Vx_e = I.
    """

    proved: Proved
    horizon: int

    def at(self, k: int, state: Array | None = None) -> StageReferences:
        """Return the references of all stages for a controller at step k: stage j is step k + j.

        Angles get the whole turns that are nearest to those of the plant's `state` (n,), if it is given; in any case
        they do not jump. ValueError: step k or k + N is outside of what is proved.
        """
        k = whole("to_acados: k", k)
        proved_steps(self.proved, k, self.horizon + 1)
        window = self.proved.reference.window(k, self.horizon)
        states, inputs = window if state is None else unwrap_near(self.proved.reference.plant, window, state)
        return StageReferences(np.concatenate([states[:-1], inputs], axis=-1), states[-1])

    def set_in(self, solver: Solver, k: int, state: Array | None = None) -> None:
        """Give a solver the references at step k: called once before each `solve`. `state` and ValueError as `at`."""
        stages = self.at(k, state)
        for stage, yref in enumerate(stages.yref):
            solver.set(stage, "yref", yref)
        solver.set(self.horizon, "yref", np.asarray(stages.yref_e))
