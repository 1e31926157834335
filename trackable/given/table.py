"""Tables of states and inputs at the steps: bounds and dynamics are proved at these instants, and nothing between."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import inf, nextafter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from flint import arb

from trackable.arguments import instance, numbers, real, whole
from trackable.arrays import Array, ArrayLike
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above
from trackable.certificates.balls.formulas import UndefinedError, at_balls
from trackable.certificates.outcome import Unproved
from trackable.files import path_of, write_json
from trackable.systems.constrained import ConstrainedSystem, LinearConstraint
from trackable.systems.linear import LinearSystem
from trackable.systems.sets.interval import Interval

FORMAT, VERSION = "trackable table", 1


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
        object.__setattr__(self, "states", x)
        object.__setattr__(self, "inputs", u)

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
            f"{kept}; each state is within {self.tolerance:g} of what the system makes of the step before "
            f"({self.defect:.3g} at most)"
        )

    def save_certificate(self, path: Path | str) -> Path:
        """Write the table for `python -m trackable check FILE`; return the path. Raises OSError."""
        from trackable.codec.converter import encode  # noqa: PLC0415  loaded for files only

        rows = {"first_step": self.table.first_step, "states": self.table.states.tolist()}
        table = {**rows, "inputs": self.table.inputs.tolist()}
        about = {"table": table, "plant": encode(self.plant), "tolerance": self.tolerance}
        write_json(path := path_of("save_certificate", path), {"format": FORMAT, "version": VERSION, **about})
        return path


@dataclass(frozen=True)
class RefutedTable:
    """At `step`, at `time` [s], the table certainly breaks a bound, or the dynamics, by `violation` at least.

    `what` says which.
    """

    step: int
    time: float
    what: str
    violation: float

    @property
    def explanation(self) -> str:
        return f"at step {self.step} (t = {self.time:.6g} s) {self.what}, by at least {self.violation:.3g}"


def certify_table(table: Table, plant: ConstrainedSystem, tolerance: float) -> CertifiedTable | RefutedTable | Unproved:
    """Prove that a table keeps the plant's bounds at its steps, and its dynamics within a tolerance; or refute it.

    The tolerance is that of each state, in its unit. Of all violations the largest one is told, as a part of the width
    of its bound, or of the tolerance. Unproved are formulas that may not be defined at a step.

    ValueError: the table does not fit the plant, or the tolerance is not positive.
    """
    tolerance = _checked(table, plant, tolerance)
    broken, defect = [found for limit in plant.given_constraints for found in _broken(table, plant, limit)], Fraction(0)
    for k in range(len(table.states) - 1):
        try:
            apart = _defects(plant.system, table.states[k], table.inputs[k], table.states[k + 1])
        except UndefinedError as undefined:
            return _unproved(plant, table.first_step + k, tolerance, inf, str(undefined))
        for name, (least, most) in zip(plant.system.states, apart, strict=True):
            defect = max(defect, most)
            if (by := least - Fraction(tolerance)) > 0:
                what = (
                    f"the system leads to another {name} than that of the next step, beyond the tolerance {tolerance:g}"
                )
                broken.append((float(by) / tolerance, _refuted(table, plant, k, what, by)))
    if broken:
        return max(broken, key=lambda found: found[0])[1]
    if defect > Fraction(tolerance):
        short = float(defect - Fraction(tolerance))
        return _unproved(plant, table.first_step, tolerance, short, "the tolerance is next to what f leads to")
    return CertifiedTable(table, plant, tolerance, nextafter(float(defect), inf))


def _checked(table: Table, plant: ConstrainedSystem, tolerance: float) -> float:
    instance("certify_table: table", table, Table, "a Table")
    instance("certify_table: plant", plant, ConstrainedSystem, "a ConstrainedSystem")
    if not (tolerance := real("certify_table: tolerance", tolerance)) > 0:
        raise ValueError(f"certify_table: tolerance must be positive, got {tolerance}")
    wanted, given = (len(plant.system.states), len(plant.system.inputs)), (table.states.shape[1], table.inputs.shape[1])
    if wanted != given:
        raise ValueError(f"table: expected {wanted[0]} states and {wanted[1]} inputs, got {given[0]} and {given[1]}")
    return tolerance


def _unproved(plant: ConstrainedSystem, step: int, tolerance: float, short: float, reason: str) -> Unproved:
    t = step * plant.sampling_time
    return Unproved("difference to the next state", Interval(-tolerance, tolerance), (t, t), short, reason)


def _broken(table: Table, plant: ConstrainedSystem, limit: LinearConstraint) -> Iterator[tuple[float, RefutedTable]]:
    """Yield where a bound is broken, with the part of its width."""
    low, high = Fraction(limit.bounds.lower), Fraction(limit.bounds.upper)
    for k, row in enumerate((table.states if limit.side == "state" else table.inputs).tolist()):
        value = sum((r * Fraction(v) for r, v in zip(limit.row, row, strict=True)), Fraction(0))
        if (by := max(low - value, value - high)) > 0:
            what = f"the {limit.name} breaks {limit.bounds}"
            yield float(by) / limit.bounds.width, _refuted(table, plant, k, what, by)


def _defects(system: Any, x: Array, u: Array, successor: Array) -> list[tuple[Fraction, Fraction]]:
    """Return bounds of |x⁺ − f(x, u)| for each state; they are equal for linear systems."""
    if isinstance(system, LinearSystem):
        values = [Fraction(v) for v in (*x.tolist(), *u.tolist())]
        rows = np.hstack([system.A, system.B]).tolist()
        made = [
            sum((Fraction(a) * v for a, v in zip(row, values, strict=True) if a), Fraction(c))
            for row, c in zip(rows, system.c.tolist(), strict=True)
        ]
        return [(d, d) for d in (abs(m - Fraction(s)) for m, s in zip(made, successor.tolist(), strict=True))]
    named: Mapping[str, arb] = dict(
        zip((*system.states, *system.inputs), map(arb, (*x.tolist(), *u.tolist())), strict=True)
    )
    with ball_arithmetic():
        balls = [abs(at_balls(f, named) - arb(s)) for f, s in zip(system.f, successor.tolist(), strict=True)]
        return [(max(Fraction(-float_above(-ball)), Fraction(0)), Fraction(float_above(ball))) for ball in balls]


def _refuted(table: Table, plant: ConstrainedSystem, row: int, what: str, by: Fraction) -> RefutedTable:
    step, below = table.first_step + row, max(nextafter(float(by), 0.0), 5e-324)
    return RefutedTable(step, step * plant.sampling_time, what, below)
