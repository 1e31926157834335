"""Tables of states and inputs at the steps: bounds and dynamics are proved at these instants, but not between them."""

from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from math import inf, nextafter
from typing import TYPE_CHECKING, Any

from trackably.arguments import array, instance, positive, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.certificate import bounds_text
from trackably.certificates.outcome import Unproved
from trackably.checker import tables as checked
from trackably.checker.form import UnreadableError, read_table
from trackably.checker.intervals import Real, UndefinedError
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
        object.__setattr__(self, "states", x)
        object.__setattr__(self, "inputs", u)

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

    `defect` is the largest of these differences, rounded up. Nothing is claimed about times between the steps.
    """

    table: Table
    plant: ConstrainedSystem
    tolerance: float
    defect: float

    @property
    def explanation(self) -> str:
        """One sentence for the user: the proved statement."""
        kept = bounds_text(self.plant.given_constraints)
        return (
            f"proved for the steps {self.table.first_step} to {self.table.last_step}, and for no time between them: "
            f"{kept}; each state is within {rounded_text(self.tolerance, 'up', 6)} of the state to which the "
            f"system leads from the step before (the largest difference is {rounded_text(self.defect, 'up')} at most)"
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


_SMALLEST = 5e-324  # the smallest positive float64


def certify_table(table: Table, plant: ConstrainedSystem, tolerance: float) -> CertifiedTable | RefutedTable | Unproved:
    """Prove that a table keeps the plant's bounds at its steps, and its dynamics within a tolerance; or refute it.

    The tolerance applies to each state, in its unit. Of several violations, the one is reported that is largest
    relative to the width of its bound or to the tolerance. Returns Unproved if neither is proved, for example because a
    formula may be undefined at a step.

    ValueError: the table does not fit the plant, or the tolerance is not positive.
    """
    tolerance = _check(table, plant, tolerance)

    def unproved(row: int, short: float, reason: str) -> Unproved:
        t, bounds = (table.first_step + row) * plant.sampling_time, Interval(-tolerance, tolerance)
        return Unproved("difference to the next state", bounds, (t, t), short, reason)

    try:
        read = replace(read_table(_content(FORMAT, table, plant, tolerance)), tolerance=0.0)
    except UnreadableError as error:
        return unproved(0, inf, f"the checker does not read it: {error}")
    broken, defect = [], Fraction(0)
    for part, rows, limits in _parts(table, plant, tolerance):
        for k in range(rows):
            try:
                found = _excesses(read, part, k)
            except UndefinedError as undefined:
                return unproved(k, inf, str(undefined))
            for i, ((what, allowed, size), (least, most)) in enumerate(zip(limits, found, strict=True)):
                if part == "dynamics":
                    defect = max(defect, most)
                if (by := least - Fraction(allowed)) > 0:
                    broken.append((float(by) / size, k, what, by, part, i))
    try:
        if broken:
            _, k, what, by, part, i = max(broken, key=lambda found: found[0])
            step, below = table.first_step + k, max(nextafter(float(by), 0.0), _SMALLEST)
            return RefutedTable(step, step * plant.sampling_time, what, below, part, i, table, plant, tolerance)
        if (over := defect - Fraction(tolerance)) > 0:
            reason = "a difference to the next state is too close to the tolerance to decide which is larger"
            return unproved(0, float(over), reason)
        shown, above = tolerance, nextafter(float(defect), inf) if defect else 0.0
        with suppress(NotAcceptedError):  # report the defect if the checker accepts it as a tolerance
            shown = CertifiedTable(table, plant, above or _SMALLEST, above).defect
        return CertifiedTable(table, plant, tolerance, shown)
    except NotAcceptedError as refused:
        return unproved(0, 0.0, str(refused))


def _check(table: Table, plant: ConstrainedSystem, tolerance: float) -> float:
    instance("certify_table: table", table, Table, "a Table")
    instance("certify_table: plant", plant, ConstrainedSystem, "a ConstrainedSystem")
    wanted, given = (len(plant.system.states), len(plant.system.inputs)), (table.states.shape[1], table.inputs.shape[1])
    if wanted != given:
        raise ValueError(f"table: expected {wanted[0]} states and {wanted[1]} inputs, got {given[0]} and {given[1]}")
    return positive("certify_table: tolerance", tolerance)


Limits = list[tuple[str, float, float]]
"""For each limit: the text about its violation, the allowed excess, and the size by which excesses are divided."""


def _parts(table: Table, plant: ConstrainedSystem, tolerance: float) -> tuple[tuple[Part, int, Limits], ...]:
    """Return "states", "inputs" and "dynamics", each with its number of rows in the table and with its limits."""
    states, inputs = (
        [
            (f"the {limit.name} breaks {limit.bounds.exactly}", 0.0, limit.bounds.width)
            for limit in plant.given_constraints
            if limit.side == side
        ]
        for side in ("state", "input")
    )
    leads = "the system leads to another {} than that of the next step, beyond the tolerance {!r}"
    dynamics = [(leads.format(name, tolerance), tolerance, tolerance) for name in plant.system.states]
    return (
        ("states", len(table.states), states),
        ("inputs", len(table.inputs), inputs),
        ("dynamics", len(table.states) - 1, dynamics),
    )


def _excesses(table: checked.Table, part: Part, row: int) -> list[tuple[Fraction, Fraction]]:
    """Return a lower and an upper bound of the excess over each limit in a row, equal for a rational excess.

    For the dynamics, with tolerance 0, the excess is |x⁺ − f(x, u)|. Raises UndefinedError.
    """
    try:
        return [(of, of) if isinstance(of, Fraction) else _ends(of) for of in checked.excesses(table, part, row)]
    except OverflowError:
        why = "its formula is too large for float64, or divides by something that may be zero"
        raise UndefinedError(why) from None


def _ends(excess: Real) -> tuple[Fraction, Fraction]:
    return Fraction(nextafter(float(excess.a), -inf)), Fraction(nextafter(float(excess.b), inf))
