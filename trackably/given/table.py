"""Tables of states and inputs at the steps: bounds and dynamics are proved at these instants, but not between them."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from trackably.arguments import array, instance, positive, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import bounds_text
from trackably.certificates.outcome import Unproved
from trackably.checker.tables import FORMAT, REFUTED, VERSION, Part
from trackably.given.accepted import AcceptedProof, AcceptedRefutation, NotAcceptedError
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval, rounded_text


@dataclass(frozen=True, eq=False)
class Table:
    """States x(k), shape (N, n), and inputs u(k), shape (N, m) or (N − 1, m), at the steps k from `first_step` on.

    The input at the last step leads to no state of the table. It may be left out; if given, it has to keep its bounds.
    ValueError: shapes do not fit, there are less than two states, or a number is not finite.
    """

    states: Array
    inputs: Array
    first_step: int = 0

    if TYPE_CHECKING:  # arguments may be whatever NumPy converts to arrays

        def __init__(self, states: ArrayLike, inputs: ArrayLike, first_step: int = 0) -> None: ...

    def __post_init__(self) -> None:
        x, u = array("table: states", self.states, None, None), array("table: inputs", self.inputs, None, None)
        whole("table: first_step", self.first_step)
        if len(x) < 2 or len(u) not in (len(x), len(x) - 1):
            raise ValueError(
                "table: expected two or more rows of states, and of inputs a row for each step (the last may be left "
                f"out), got states of shape {x.shape} and inputs of shape {u.shape}"
            )
        vars(self).update(states=x, inputs=u)

    @property
    def last_step(self) -> int:
        """The step of the last row of states."""
        return self.first_step + len(self.states) - 1

    def __repr__(self) -> str:
        shapes = f"states of shape {self.states.shape}, inputs of shape {self.inputs.shape}"
        return f"Table(steps {self.first_step} to {self.last_step}, {shapes})"


@dataclass(frozen=True, eq=False, repr=False)
class CertifiedTable(AcceptedProof):
    """A table that keeps its bounds at its steps, with |x(k + 1) − f(x(k), u(k))| ≤ `tolerance` for each state.

    Nothing is claimed about times between the steps.
    """

    table: Table
    plant: ConstrainedSystem
    tolerance: float

    @property
    def explanation(self) -> str:
        """One sentence for the user: the proved statement."""
        kept = bounds_text(self.plant.given_constraints)
        return (
            f"proved for the steps {self.table.first_step} to {self.table.last_step}, and for no time between them: "
            f"{kept}; each state is within {rounded_text(self.tolerance, 'up')} of the state to which the "
            "system leads from the step before"
        )

    @property
    def content(self) -> dict[str, Any]:
        """The content of the file that the checker reads."""
        return _content(FORMAT, self.table, self.plant, self.tolerance)


@dataclass(frozen=True, eq=False, repr=False)
class RefutedTable(AcceptedRefutation):
    """At `step`, at `time` [s], the table certainly violates a bound, or the dynamics, by at least `violation`.

    `what` describes the violation. `part` is "states", "inputs" or "dynamics", and `index` is that of the bound in its
    set, or of the state whose dynamics are violated.
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
        """One sentence for the user: the violation."""
        least = rounded_text(self.violation, "down")
        return f"at step {self.step} (t = {self.time:.6g} s) {self.what}, by at least {least}"

    @property
    def content(self) -> dict[str, Any]:
        """The content of the file that the checker reads."""
        at = {"step": self.step, "part": self.part, "index": self.index, "violation": self.violation}
        return {**_content(REFUTED, self.table, self.plant, self.tolerance), "at": at}


def _content(form: str, table: Table, plant: ConstrainedSystem, tolerance: float) -> dict[str, Any]:
    from trackably.codec import encode  # noqa: PLC0415  loaded for files only

    rows = {"first_step": table.first_step, "states": table.states.tolist(), "inputs": table.inputs.tolist()}
    return {"format": form, "version": VERSION, "table": rows, "plant": encode(plant), "tolerance": tolerance}


_PARTS = (1 - 1e-15, 1 - 1e-9, 0.999, 0.5)
"""A violation found in float64 is multiplied by each of these factors, until the checker accepts the product."""

_ROUNDING = 1e-15  # part of the largest state that is added to the largest difference, so that it can be proved


def certify_table(table: Table, plant: ConstrainedSystem, tolerance: float) -> CertifiedTable | RefutedTable | Unproved:
    """Prove that a table keeps the plant's bounds at its steps, and its dynamics within a tolerance; or refute it.

    The tolerance applies to each state, in its unit. If the table keeps the dynamics within less, this less is proved.
    Of several violations, the one is reported that is largest relative to the width of its bound or to the tolerance.
    It is found in float64; the checker decides. Returns Unproved if neither is proved, for example because a formula
    may be undefined at a step.

    ValueError: the table does not fit the plant, or the tolerance is not positive.
    """
    tolerance = _check(table, plant, tolerance)
    T, off = plant.sampling_time, _differences(table, plant)
    limits = _limits(table, plant, off, tolerance)
    found = sorted(limits, key=lambda of: float(np.max(of[4])) / of[3], reverse=True)
    for part, index, what, _, excesses in found:
        step, most = table.first_step + int(np.argmax(excesses)), float(np.max(excesses))
        for violation in (factor * most for factor in _PARTS if most > 0):
            with suppress(NotAcceptedError):
                return RefutedTable(step, step * T, what, violation, part, index, table, plant, tolerance)
    defect = float(np.max(off) + _ROUNDING * (np.max(np.abs(table.states)) or 1.0))
    for proposed in (min(defect, tolerance), tolerance):
        try:
            return CertifiedTable(table, plant, proposed)
        except NotAcceptedError as refused:
            reason = str(refused)
    at, bounds = (table.first_step * T, table.last_step * T), Interval(-tolerance, tolerance)
    short = max(0.0, float(np.max(off)) - tolerance)
    return Unproved("difference to the next state", bounds, at, short, reason)


def _check(table: Table, plant: ConstrainedSystem, tolerance: float) -> float:
    instance("certify_table: table", table, Table, "a Table")
    instance("certify_table: plant", plant, ConstrainedSystem, "a ConstrainedSystem")
    wanted, given = (len(plant.system.states), len(plant.system.inputs)), (table.states.shape[1], table.inputs.shape[1])
    if wanted != given:
        raise ValueError(f"table: expected {wanted[0]} states and {wanted[1]} inputs, got {given[0]} and {given[1]}")
    return positive("certify_table: tolerance", tolerance)


def _differences(table: Table, plant: ConstrainedSystem) -> Array:
    """Return |x(k + 1) − f(x(k), u(k))| in float64, shape (N − 1, n); 0 where it is not finite."""
    with np.errstate(all="ignore"):
        successors = plant.system.successor(table.states[:-1], table.inputs[: len(table.states) - 1])
        return np.nan_to_num(np.abs(successors - table.states[1:]), posinf=0.0)


Limit = tuple[Part, int, str, float, Array]
"""A limit by part and index as in a `RefutedTable`: the text about its violation, its size, and each row's excess."""


def _limits(table: Table, plant: ConstrainedSystem, off: Array, tolerance: float) -> Iterator[Limit]:
    """Yield each bound of states and inputs, then the `tolerance` for each state, with how far each row exceeds them.

    `off`, shape (N − 1, n), are the differences |x(k + 1) − f(x(k), u(k))|. Excesses are negative where a limit is
    kept.
    """
    sides: tuple[tuple[str, Part, Array], ...] = (("state", "states", table.states), ("input", "inputs", table.inputs))
    for side, part, values in sides:
        times = (table.first_step + np.arange(float(len(values)))) * plant.sampling_time
        for i, limit in enumerate(of for of in plant.given_constraints if of.side == side):
            excesses = -limit.bounds.margin(values @ np.array(limit.row, dtype=float), times)
            yield part, i, f"the {limit.name} breaks {limit.bounds.exactly}", limit.bounds.width, excesses
    for i, name in enumerate(plant.system.states):
        what = f"the system leads to another {name} than that of the next step, beyond the tolerance {tolerance!r}"
        yield "dynamics", i, what, tolerance, off[:, i] - tolerance
