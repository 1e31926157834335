"""What is learned about the methods: how conservative program (9) is, and how much depends on the draw of samples."""

from dataclasses import dataclass

from trackable.arrays import Array


@dataclass(frozen=True)
class Conservatism:
    """Program (9) with η = `counts` intervals: l at its optimum and the smallest margins over all phases, shapes (n,).

    An η for which (9) has no solution is left out.
    """

    counts: Array
    objectives: Array
    state_margins: Array
    input_margins: Array


@dataclass(frozen=True)
class Draws:
    """The same experiment with samples drawn from other `seeds`, one entry for each.

    `free_…` is the unconstrained optimum and `exact_…` the exact form's (the same one where that keeps all bounds):
    l, the learned period [s], the root mean square distance to the true reference. Margins are over all phases.
    """

    seeds: Array
    free_objectives: Array
    free_periods: Array
    free_errors: Array
    state_margins: Array
    input_margins: Array
    exact_objectives: Array
    exact_periods: Array
    exact_errors: Array


@dataclass(frozen=True)
class Study:
    """Both, for one experiment."""

    conservatism: Conservatism
    draws: Draws
