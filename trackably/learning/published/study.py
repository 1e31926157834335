"""Results of studies: the conservatism of program (8), other draws of the samples, and tighter bounds."""

from dataclasses import dataclass, field

from trackably.arrays import Array


@dataclass(frozen=True)
class Conservatism:
    """For program (8) with η = `counts` intervals: l at the optimum, and the smallest margins over all phases.

    All shapes are (n,). An η for which (8) has no solution is left out.
    """

    counts: Array
    objectives: Array
    state_margins: Array
    input_margins: Array


@dataclass(frozen=True)
class Draws:
    """The same experiment with samples drawn from other `seeds`: arrays with one entry for each seed.

    `free_…` describes the unconstrained optimum, `exact_…` the optimum with all phases constrained; both are the same
    if the unconstrained optimum keeps all bounds. Each has l, the learned period [s] and the root mean square distance
    to the true reference. The margins are the smallest margins of the unconstrained optimum over all phases.
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
class Tightness:
    """References of one method, proved for other upper bounds of the state: arrays with one entry for each of `uppers`.

    Each has its objective J, and the root mean square distances to its samples and to the true reference. A bound for
    which no reference was proved is left out.
    """

    uppers: Array
    objectives: Array
    misfits: Array
    errors: Array


@dataclass(frozen=True)
class Study:
    """The studies of one experiment; `tightness` is by method."""

    conservatism: Conservatism
    draws: Draws
    tightness: dict[str, Tightness] = field(default_factory=dict)
