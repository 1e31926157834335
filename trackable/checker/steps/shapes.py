"""Before the proof: matrices, formulas, trajectories, sets and names belong to one system."""

from trackable.checker.certificate import Certificate, Instants, LinearSystem, NonlinearSystem, Row, Trajectories
from trackable.checker.formulas.formula import names


def check_shapes(certificate: Certificate) -> str | None:
    """Return what does not fit together; None where everything does."""
    system = certificate.system
    n, m = len(system.states), len(system.inputs)
    if any(len(signal.centres) != len(signal.weights) for signal in certificate.signals):
        return "signals: there must be as many centres as weights"
    if (certificate.state_set.dimension, certificate.input_set.dimension) != (n, m):
        return "shapes: the sets must have the dimensions of state and input"
    if not _fit(certificate.state_set.rows, n) or not _fit(
        (*certificate.input_set.rows, *(certificate.attainable or ())), m
    ):
        return "shapes: every bound needs a row with a number for each state, or for each input, not all zero"
    if isinstance(system, NonlinearSystem):
        reason = _misfit_of_formulas(certificate, system)
    else:
        assert certificate.trajectories is not None
        reason = _misfit_of_matrices(certificate, system, certificate.trajectories)
    return reason or _misfit_of_names(certificate)


def _fit(rows: tuple[Row, ...], dimension: int) -> bool:
    return all(len(row.row) == dimension and any(row.row) for row in rows)


def _misfit_of_names(certificate: Certificate) -> str | None:
    coordinates = [*certificate.system.states, *certificate.system.inputs]
    if len(set(coordinates)) != len(coordinates):
        return "names: states and inputs must all be called differently"
    claim, bounded = certificate.claim, sorted(bound.name for bound in certificate.bounds)
    covers = bounded if isinstance(claim, Instants) else sorted(claim.cover.boxes)
    if not bounded:
        return "names: nothing is bounded"
    if len(set(bounded)) != len(bounded) or sorted(certificate.errors) != bounded or covers != bounded:
        return "names: evaluation errors and covers must have the names of the bounds, each once"
    return None


def _misfit_of_matrices(certificate: Certificate, system: LinearSystem, trajectories: Trajectories) -> str | None:
    n, m = len(system.states), len(system.inputs)
    if (
        [len(row) for row in system.A] != [n] * n
        or [len(row) for row in system.B] != [m] * n
        or len(system.c) != n
        or (len(trajectories.states), len(trajectories.inputs)) != (n, m)
    ):
        return "shapes: A, B, c, names and trajectories are not those of one system"
    for parts in (trajectories.states, trajectories.inputs):
        shifts = [len(weights) for weights in parts[0].weights]
        if len(shifts) != len(certificate.signals) or any([len(w) for w in part.weights] != shifts for part in parts):
            return "shapes: every state and every input needs weights of the same shape, for each signal"
    return None


def _misfit_of_formulas(certificate: Certificate, system: NonlinearSystem) -> str | None:
    n = len(system.states)
    if not len(system.f) == len(certificate.signals) == n == len(system.inputs):
        return "shapes: as many formulas, signals, states and inputs are needed"
    known = {*system.states, *system.inputs}
    if len({*known, *system.successors}) != 3 * n:
        return "names: states, states⁺ and inputs must all be called differently"
    if unknown := {name for formula in system.f for name in names(formula)} - known:
        return f"names: f must hold states and inputs only, but holds {', '.join(sorted(unknown))}"
    rows = [side.row for side in certificate.input_set.rows]
    free = [name for i, name in enumerate(system.inputs) if not any(row[i] for row in rows)]
    if free:  # only in bounded quantities are formulas shown to be defined
        return f"bounds: every input of a nonlinear system must be bounded, but {', '.join(free)} is not"
    return None
