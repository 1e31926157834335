"""A table of states and inputs at the steps, as a file says it."""

from dataclasses import dataclass

from trackable.checker.subject import Polytope, System

FORMAT, VERSION = "trackable table", 1


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
