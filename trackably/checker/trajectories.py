"""Step 0 of the proof (`checker`): the states of a linear system follow from its inputs, in rational arithmetic.

Before this step, matrices, formulas, trajectories, sets and names are shown to fit together.
"""

from fractions import Fraction
from itertools import zip_longest

from trackably.checker.certificate import Certificate, Steps
from trackably.checker.flatness import why_not_flat
from trackably.checker.formulas import names
from trackably.checker.limits import WEIGHTS
from trackably.checker.quantities import weighted_sum
from trackably.checker.subject import (
    FlatForm,
    LinearSystem,
    NonlinearSystem,
    Plant,
    Row,
    Subject,
    System,
    Trajectories,
    indices,
)
from trackably.checker.watch import tick


def check_shapes(subject: Subject) -> str | None:
    """Return which parts of a file's reference, system and sets do not fit together; None if all do."""
    system = subject.system
    if any(len(signal.centres) != len(signal.weights) for signal in subject.signals):
        return "signals: each must have as many weights as centres"
    if reason := why_no_plant(subject, subject.attainable or ()):
        return reason
    if isinstance(system, NonlinearSystem):
        reason = _misfit_of_formulas(subject, system)
    else:
        assert subject.trajectories is not None
        reason = _misfit_of_trajectories(subject, subject.trajectories)
    if not reason and _weights(subject) > WEIGHTS:
        reason = f"shapes: there are more than {WEIGHTS} weights of shifted signals"
    return reason


def why_no_system(system: System) -> str | None:
    """Return which parts of a system do not fit together; None if all do."""
    n, m = len(system.states), len(system.inputs)
    known = {*system.states, *system.inputs}
    if len(known) != n + m:
        return "names: states and inputs must all have different names"
    if isinstance(system, LinearSystem):
        if [[len(row) for row in matrix] for matrix in (system.A, system.B, (system.c,))] == [[n] * n, [m] * n, [n]]:
            return None
        return f"shapes: A, B and c do not fit {n} states and {m} inputs"
    flat = system.flat
    if len(system.f) != n or (flat and (len(flat.states), len(flat.inputs)) != (n, m)):
        return (
            f"shapes: as many formulas f as states are needed, {n}; a flat form needs one for each state and each input"
        )
    if unknown := {name for formula in system.f for name in names(formula)} - known:
        return f"names: f must hold states and inputs only, but holds {min(unknown)}"
    return "flat: angles must be states" if flat and not {*flat.angles} <= {*system.states} else None


def why_no_plant(plant: Plant, attainable: tuple[Row, ...] = ()) -> str | None:
    """Return what does not fit together in a system and its sets; None if everything fits."""
    n, m = len(plant.system.states), len(plant.system.inputs)
    if (plant.state_set.dimension, plant.input_set.dimension) != (n, m):
        return f"shapes: the sets must have the dimensions of state and input, {n} and {m}"
    if not _fit(plant.state_set.rows, n) or not _fit((*plant.input_set.rows, *attainable), m):
        return "shapes: every row of a set needs a number for each state, or for each input, and not only zeros"
    return why_no_system(plant.system)


def _weights(subject: Subject) -> int:
    """Return the number of weights of shifted signals that a check needs.

    They are those of all bounds of a linear system, or of all arguments of formulas of a nonlinear system.
    """
    rows, shifted = len(subject.bounds), sum(subject.shifts)
    if isinstance(subject.system, LinearSystem):
        return rows * shifted
    shifted += len(subject.signals)  # states one step later
    return (rows + shifted) * shifted


def _fit(rows: tuple[Row, ...], dimension: int) -> bool:
    return all(len(row.row) == dimension and any(row.row) for row in rows)


def check_names(certificate: Certificate) -> str | None:
    """Return why the evaluation errors or the boxes are not given once for each bound, by name; None if they are."""
    proof, bounded = certificate.proof, sorted(bound.name for bound in certificate.subject.bounds)
    covers = bounded if isinstance(proof, Steps) or certificate.subject.pieces else sorted(proof.boxes)
    if not bounded:
        return "names: nothing is bounded, so there is nothing to prove"
    if len(set(bounded)) != len(bounded) or sorted(certificate.errors) != bounded or covers != bounded:
        return "names: the bounds must have different names, and evaluation errors and covers these names, each once"
    return None


def _misfit_of_trajectories(subject: Subject, trajectories: Trajectories) -> str | None:
    if (len(trajectories.states), len(trajectories.inputs)) != (len(subject.system.states), len(subject.system.inputs)):
        return "shapes: `trajectories` must have an entry for each state and each input"
    for parts in (trajectories.states, trajectories.inputs):
        shifts = [len(weights) for weights in parts[0].weights]
        if len(shifts) != subject.signal_count or any([len(w) for w in part.weights] != shifts for part in parts):
            return "shapes: for each signal, all states need the same number of weights, and so do all inputs"
    return None


def _misfit_of_formulas(subject: Subject, system: NonlinearSystem) -> str | None:
    if system.flat is not None:
        return _misfit_of_flat_form(subject, system.flat)
    n = len(system.states)
    if not len(subject.signals) == n == len(system.inputs):
        return (
            f"shapes: as many signals and inputs as states are needed, {n}, got {len(subject.signals)} signals and "
            f"{len(system.inputs)} inputs"
        )
    rows = [side.row for side in subject.input_set.rows]
    free = [name for i, name in enumerate(system.inputs) if not any(row[i] for row in rows)]
    if free:  # the formula of an input is shown to be defined only if some row has the input
        return f"bounds: every input of a nonlinear system must be bounded, but {free[0]} is not"
    return None


def _misfit_of_flat_form(subject: Subject, flat: FlatForm) -> str | None:
    try:
        found = [indices(name) for formula in (*flat.states, *flat.inputs, *flat.positive) for name in names(formula)]
    except ValueError as other:
        return f"flat: formulas must hold shifted signals z1[0], z1[1], … only, but hold {other}"
    if {s for s, _ in flat.indices} != {*range(len(subject.signals))} or max(s for s, _ in found) >= len(
        subject.signals
    ):
        return "flat: the formulas must contain each signal of the reference, and no others"
    if max(j for _, j in found) > flat.last_shift + 1:
        return "flat: formulas in `positive` must look no further ahead than those of the states one step later"
    return None


def check_trajectories(subject: Subject) -> str | None:
    """Return why x(t + T) = A x(t) + B u(t) + c does not hold for all signals; None if it does.

    For a flat form, the equation is x(t + T) = f(x(t), u(t)). A nonlinear system without a flat form is solved for u,
    so that the equation holds.
    """
    system, trajectories = subject.system, subject.trajectories
    if isinstance(system, NonlinearSystem) and system.flat is not None:
        return why_not_flat(system, system.flat)
    if not isinstance(system, LinearSystem) or trajectories is None:
        return None
    for A, B, c, state in zip(*system.exact, trajectories.states, strict=True):
        x, u = weighted_sum(A, trajectories.states), weighted_sum(B, trajectories.inputs)
        if x.offset + u.offset + c != state.offset:
            return "trajectories: the offsets of states and inputs are no equilibrium of the system"
        for s, weights in enumerate(state.weights):
            earlier = Fraction(0), *weights
            for j, (p, q, r) in enumerate(zip_longest(x.weights[s], u.weights[s], earlier, fillvalue=Fraction(0))):
                tick()
                if p + q != r:
                    law = "x(t + T) = A x(t) + B u(t) + c fails"
                    return f"trajectories: the system does not follow signal {s} with the weights of shift {j}: {law}"
    return None
