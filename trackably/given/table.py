"""Tables of states and inputs at the steps: bounds and dynamics are proved at these instants, and nothing between."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from trackably.arguments import numbers, whole
from trackably.arrays import Array, ArrayLike
from trackably.files import new_file, write_json
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.sets.interval import rounded

FORMAT, REFUTED, VERSION = "trackably table", "trackably refuted table", 1

Part = Literal["states", "inputs", "dynamics"]
"""What a table may break: a row of the state set or of the input set, or the next value of a state."""


@dataclass(frozen=True, eq=False)
class Table:
    """States x(k), shape (N, n), and inputs u(k), shape (N, m) or (N − 1, m), at the steps k from `first_step` on.

    The input of the last state leads nowhere: it may be left out, and has to keep its bounds if it is there.
    ValueError: shapes do not fit, there are less than two states, or a number is not finite.
    """

    states: Array
    inputs: Array
    first_step: int = 0

    if TYPE_CHECKING:  # arrays are made of what is given

        def __init__(self, states: ArrayLike, inputs: ArrayLike, first_step: int = 0) -> None: ...

    def __post_init__(self) -> None:
        x, u = numbers("table: states", self.states), numbers("table: inputs", self.inputs)
        whole("table: first_step", self.first_step)
        if x.ndim != 2 or u.ndim != 2 or len(x) < 2 or len(u) not in (len(x), len(x) - 1):
            raise ValueError(f"table: expected a row for each step, got states of shape {x.shape}, inputs {u.shape}")
        if not (np.all(np.isfinite(x)) and np.all(np.isfinite(u))):
            raise ValueError("table: states and inputs must be finite")
        for name, array in (("states", x), ("inputs", u)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def last_step(self) -> int:
        return self.first_step + len(self.states) - 1


@dataclass(frozen=True, eq=False)
class CertifiedTable:
    """A table that keeps its bounds at its steps, where |x(k + 1) − f(x(k), u(k))| ≤ `tolerance` for each state.

    `defect` is the largest of these differences, rounded up. Nothing is said about times between the steps.
    """

    table: Table
    plant: ConstrainedSystem
    tolerance: float
    defect: float

    @property
    def explanation(self) -> str:
        """What is proved, in a sentence."""
        kept = ", ".join(f"{limit.name} in {limit.bounds}" for limit in self.plant.given_constraints)
        return (
            f"proved for the steps {self.table.first_step} to {self.table.last_step}, and for no time between them: "
            f"{kept}; each state is within {rounded(self.tolerance, 'up', 6)} of what the system makes of the step "
            f"before ({rounded(self.defect, 'up')} at most)"
        )

    def save_certificate(self, path: Path | str) -> Path:
        """Write the table for `python -m trackably check FILE`; return the path. Raises OSError."""
        write_json(path := new_file("save_certificate", path), self.content)
        return path

    @property
    def content(self) -> dict[str, Any]:
        """What its file says."""
        return {"format": FORMAT, "version": VERSION, **_written(self.table, self.plant, self.tolerance)}


@dataclass(frozen=True, eq=False)
class RefutedTable:
    """At `step`, at `time` [s], the table certainly breaks a bound, or the dynamics, by `violation` at least.

    `what` says which: the row or the state with this `index` of a `part`.
    """

    step: int
    time: float
    what: str
    violation: float
    part: Part
    index: int
    table: Table
    plant: ConstrainedSystem
    tolerance: float

    @property
    def explanation(self) -> str:
        return f"at step {self.step} (t = {self.time:.6g} s) {self.what}, by at least {rounded(self.violation, 'down')}"

    def save_counterexample(self, path: Path | str) -> Path:
        """Write the table and where it is broken for `python -m trackably check`; return the path. Raises OSError."""
        write_json(path := new_file("save_counterexample", path), self.content)
        return path

    @property
    def content(self) -> dict[str, Any]:
        """What its file says."""
        at = {"step": self.step, "part": self.part, "index": self.index, "violation": self.violation}
        return {"format": REFUTED, "version": VERSION, **_written(self.table, self.plant, self.tolerance), "at": at}


def _written(table: Table, plant: ConstrainedSystem, tolerance: float) -> dict[str, Any]:
    from trackably.codec.converter import encode  # noqa: PLC0415  loaded for files only

    rows = {"first_step": table.first_step, "states": table.states.tolist(), "inputs": table.inputs.tolist()}
    return {"table": rows, "plant": encode(plant), "tolerance": tolerance}
