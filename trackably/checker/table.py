"""A table of states and inputs at the steps, as a file says it."""

from dataclasses import dataclass
from typing import Literal

from trackably.checker.subject import Polytope, System

FORMAT, REFUTED, VERSION = "trackably table", "trackably refuted table", 1

Part = Literal["states", "inputs", "dynamics"]


@dataclass(frozen=True)
class Table:
    """States and inputs at the steps from `first_step` on; the last state may have no input."""

    first_step: int
    states: tuple[tuple[float, ...], ...]
    inputs: tuple[tuple[float, ...], ...]
    system: System
    state_set: Polytope
    input_set: Polytope
    tolerance: float


@dataclass(frozen=True)
class RefutedTable:
    """At a `step`, a table breaks a row of its state or input set, or the dynamics of a state, by `violation` at least.

    `index` counts the rows of the set, or the states, from 0 on.
    """

    table: Table
    step: int
    part: Part
    index: int
    violation: float
