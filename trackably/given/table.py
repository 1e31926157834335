"""Tables of states and inputs at the steps: bounds and dynamics are proved at these instants, but not between them."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from math import inf, nextafter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackably.arguments import array, instance, positive, whole
from trackably.arrays import Array, ArrayLike
from trackably.certificates.judge import judged_file
from trackably.certificates.outcome import Unproved
from trackably.checker import Proved, Refuted
from trackably.checker import tables as checked
from trackably.checker.form import UnreadableError, read_table
from trackably.checker.intervals import Real, UndefinedError
from trackably.checker.subject import Polytope
from trackably.checker.tables import FORMAT, REFUTED, VERSION, Part, differences, value_of_row
from trackably.files import new_file, write_json
from trackably.systems.constrained import ConstrainedSystem, Side
from trackably.systems.intervals import Interval, rounded_text


@dataclass(frozen=True, eq=False)
class Table:
    """States x(k), shape (N, n), and inputs u(k), shape (N, m) or (N − 1, m), at the steps k from `first_step` on.

    The input at the last state has no successor: it may be left out, and has to keep its bounds if it is given.
    ValueError: shapes do not fit, there are less than two states, or a number is not finite.
    """

    states: Array
    inputs: Array
    first_step: int = 0

    if TYPE_CHECKING:  # arrays are made of what is given

        def __init__(self, states: ArrayLike, inputs: ArrayLike, first_step: int = 0) -> None: ...

    def __post_init__(self) -> None:
        x, u = array("table: states", self.states, None, None), array("table: inputs", self.inputs, None, None)
        whole("table: first_step", self.first_step)
        if len(x) < 2 or len(u) not in (len(x), len(x) - 1):
            raise ValueError(f"table: expected a row for each step, got states of shape {x.shape}, inputs {u.shape}")
        object.__setattr__(self, "states", x)
        object.__setattr__(self, "inputs", u)

    @property
    def last_step(self) -> int:
        return self.first_step + len(self.states) - 1


@dataclass(frozen=True, eq=False)
class CertifiedTable:
    """A table that keeps its bounds at its steps, with |x(k + 1) − f(x(k), u(k))| ≤ `tolerance` for each state.

    `defect` is the largest of these differences, rounded up. Nothing is claimed about times between the steps.
    """

    table: Table
    plant: ConstrainedSystem
    tolerance: float
    defect: float

    @property
    def explanation(self) -> str:
        """The proved statement in a sentence."""
        kept = ", ".join(f"{limit.name} in {limit.bounds}" for limit in self.plant.given_constraints)
        return (
            f"proved for the steps {self.table.first_step} to {self.table.last_step}, and for no time between them: "
            f"{kept}; each state is within {rounded_text(self.tolerance, 'up', 6)} of what the system makes of the "
            f"step before ({rounded_text(self.defect, 'up')} at most)"
        )

    def save_certificate(self, path: Path | str) -> Path:
        """Write the table for `python -m trackably check FILE`; return the path. Raises OSError."""
        write_json(path := new_file("save_certificate", path), self.content)
        return path

    @property
    def content(self) -> dict[str, Any]:
        """The content of its file."""
        return {"format": FORMAT, "version": VERSION, **_encode(self.table, self.plant, self.tolerance)}


@dataclass(frozen=True, eq=False)
class RefutedTable:
    """At `step`, at `time` [s], the table certainly violates a bound, or the dynamics, by at least `violation`.

    `what` describes the row or the state, which has this `index` in a `part` of the table.
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
        least = rounded_text(self.violation, "down")
        return f"at step {self.step} (t = {self.time:.6g} s) {self.what}, by at least {least}"

    def save_counterexample(self, path: Path | str) -> Path:
        """Write the table and its violation for `python -m trackably check`; return the path. Raises OSError."""
        write_json(path := new_file("save_counterexample", path), self.content)
        return path

    @property
    def content(self) -> dict[str, Any]:
        """The content of its file."""
        at = {"step": self.step, "part": self.part, "index": self.index, "violation": self.violation}
        return {"format": REFUTED, "version": VERSION, **_encode(self.table, self.plant, self.tolerance), "at": at}


def _encode(table: Table, plant: ConstrainedSystem, tolerance: float) -> dict[str, Any]:
    from trackably.codec import encode  # noqa: PLC0415  loaded for files only

    rows = {"first_step": table.first_step, "states": table.states.tolist(), "inputs": table.inputs.tolist()}
    return {"table": rows, "plant": encode(plant), "tolerance": tolerance}


_SMALLEST = 5e-324  # a positive float64


def certify_table(table: Table, plant: ConstrainedSystem, tolerance: float) -> CertifiedTable | RefutedTable | Unproved:
    """Prove that a table keeps the plant's bounds at its steps, and its dynamics within a tolerance; or refute it.

    The tolerance applies to each state, in its unit. The largest violation is reported, relative to the width of its
    bound or to the tolerance. Returns Unproved if formulas may be undefined at a step.

    ValueError: the table does not fit the plant, or the tolerance is not positive.
    """
    tolerance = _check(table, plant, tolerance)
    try:
        read = read_table(CertifiedTable(table, plant, tolerance, tolerance).content)
    except UnreadableError as error:
        return _make_unproved(plant, table.first_step, tolerance, inf, f"the checker does not read it: {error}")
    broken, defect = list(_find_violations(read, plant)), Fraction(0)
    for k in range(len(table.states) - 1):
        try:
            apart = _defects(read, k)
        except UndefinedError as undefined:
            return _make_unproved(plant, table.first_step + k, tolerance, inf, str(undefined))
        for i, (name, (least, most)) in enumerate(zip(plant.system.states, apart, strict=True)):
            defect = max(defect, most)
            if (by := least - Fraction(tolerance)) > 0:
                what = (
                    f"the system leads to another {name} than that of the next step, beyond the tolerance {tolerance!r}"
                )
                broken.append((float(by) / tolerance, k, what, by, "dynamics", i))
    if broken:
        _, k, what, by, part, i = max(broken, key=lambda found: found[0])
        step, below = table.first_step + k, max(nextafter(float(by), 0.0), _SMALLEST)
        return _judge(RefutedTable(step, step * plant.sampling_time, what, below, part, i, table, plant, tolerance))
    if defect > Fraction(tolerance):
        short = float(defect - Fraction(tolerance))
        return _make_unproved(plant, table.first_step, tolerance, short, "the tolerance is next to what f leads to")
    return _judge(CertifiedTable(table, plant, tolerance, nextafter(float(defect), inf) if defect else 0.0))


def _judge(found: CertifiedTable | RefutedTable) -> CertifiedTable | RefutedTable | Unproved:
    """Return the result if the checker accepts it, and Unproved if it refuses it.

    The defect is reported only if the checker also accepts it as a tolerance; otherwise the tolerance is reported.
    """
    _, verdict = judged_file(found.content)
    if isinstance(found, CertifiedTable) and isinstance(verdict, Proved):
        _, of_defect = judged_file(replace(found, tolerance=found.defect or _SMALLEST).content)
        return found if isinstance(of_defect, Proved) else replace(found, defect=found.tolerance)
    if isinstance(found, RefutedTable) and isinstance(verdict, Refuted):
        return found
    why = f"the checker does not accept it ({verdict})"
    return _make_unproved(found.plant, found.table.first_step, found.tolerance, 0.0, why)


def _check(table: Table, plant: ConstrainedSystem, tolerance: float) -> float:
    instance("certify_table: table", table, Table, "a Table")
    instance("certify_table: plant", plant, ConstrainedSystem, "a ConstrainedSystem")
    wanted, given = (len(plant.system.states), len(plant.system.inputs)), (table.states.shape[1], table.inputs.shape[1])
    if wanted != given:
        raise ValueError(f"table: expected {wanted[0]} states and {wanted[1]} inputs, got {given[0]} and {given[1]}")
    return positive("certify_table: tolerance", tolerance)


def _make_unproved(plant: ConstrainedSystem, step: int, tolerance: float, short: float, reason: str) -> Unproved:
    t = step * plant.sampling_time
    return Unproved("difference to the next state", Interval(-tolerance, tolerance), (t, t), short, reason)


def _find_violations(
    table: checked.Table, plant: ConstrainedSystem
) -> Iterator[tuple[float, int, str, Fraction, Part, int]]:
    """Yield violations of bounds: size relative to the width, row, sentence, size, part and index."""
    sides: tuple[tuple[Part, Side, tuple[tuple[float, ...], ...], Polytope], ...] = (
        ("states", "state", table.states, table.state_set),
        ("inputs", "input", table.inputs, table.input_set),
    )
    for part, side, values, bounded in sides:
        limits = [limit for limit in plant.given_constraints if limit.side == side]
        for i, (limit, bound) in enumerate(zip(limits, bounded.rows, strict=True)):
            for k, row in enumerate(values):
                value = value_of_row(bound, row)
                if (by := max(Fraction(bound.lower) - value, value - Fraction(bound.upper))) > 0:
                    what = f"the {limit.name} breaks {limit.bounds.exactly}"
                    yield float(by) / limit.bounds.width, k, what, by, part, i


def _defects(table: checked.Table, row: int) -> list[tuple[Fraction, Fraction]]:
    """Return lower and upper bounds of |x⁺ − f(x, u)| for each state, which are equal for linear systems.

    Raises UndefinedError.
    """
    try:
        return [(a, a) if isinstance(a, Fraction) else _ends(a) for a in differences(table, row)]
    except OverflowError:
        why = "its formula is too large for float64, or divides by something that may be zero"
        raise UndefinedError(why) from None


def _ends(apart: Real) -> tuple[Fraction, Fraction]:
    return Fraction(max(nextafter(float(apart.a), -inf), 0.0)), Fraction(nextafter(float(apart.b), inf))
