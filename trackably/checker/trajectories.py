"""Step 0 of the proof (`checker`): the states of a linear system follow from its inputs, in rational arithmetic.

Before this step, matrices, formulas, trajectories, sets and names are shown to fit together.
"""

from fractions import Fraction
from itertools import zip_longest

from trackably.checker.answers import FailedStepError
from trackably.checker.certificate import Certificate, Steps
from trackably.checker.flatness import check_flat_form
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


def check_shapes(subject: Subject) -> None:
    """Raise FailedStepError unless all parts of a file's reference, system and sets fit together."""
    system = subject.system
    if any(len(signal.centres) != len(signal.weights) for signal in subject.signals):
        raise FailedStepError("signals: each must have as many weights as centres")
    check_plant(subject, subject.attainable or ())
    if isinstance(system, NonlinearSystem):
        _check_formulas(subject, system)
    else:
        assert subject.trajectories is not None
        _check_weights(subject, subject.trajectories)
    if _weights(subject) > WEIGHTS:
        raise FailedStepError(f"shapes: there are more than {WEIGHTS} weights of shifted signals")


def _check_system(system: System) -> None:
    n, m = len(system.states), len(system.inputs)
    known = {*system.states, *system.inputs}
    if len(known) != n + m:
        raise FailedStepError("names: states and inputs must all have different names")
    if isinstance(system, LinearSystem):
        if not system.fits(n, m):
            raise FailedStepError(f"shapes: A, B and c do not fit {n} states and {m} inputs")
        return
    flat = system.flat
    if len(system.f) != n or (flat and (len(flat.states), len(flat.inputs)) != (n, m)):
        raise FailedStepError(
            f"shapes: expected f with one formula for each of {n} states, got {len(system.f)}; if there is a flat "
            "form, it must have one formula for each state and each input"
        )
    if unknown := {name for formula in system.f for name in names(formula)} - known:
        raise FailedStepError(f"names: f must hold states and inputs only, but holds {min(unknown)}")
    if flat and not {*flat.angles} <= {*system.states}:
        raise FailedStepError("flat: angles must be states")


def check_plant(plant: Plant, attainable: tuple[Row, ...] = ()) -> None:
    """Raise FailedStepError unless all parts of a system and its sets fit together."""
    n, m = len(plant.system.states), len(plant.system.inputs)
    if (plant.state_set.dimension, plant.input_set.dimension) != (n, m):
        raise FailedStepError(f"shapes: the sets must have the dimensions of state and input, {n} and {m}")
    if not _fit(plant.state_set.rows, n) or not _fit((*plant.input_set.rows, *attainable), m):
        raise FailedStepError(
            "shapes: every row of a set needs a number for each state, or for each input, and not only zeros"
        )
    _check_system(plant.system)


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


def check_names(certificate: Certificate) -> None:
    """Raise FailedStepError unless the evaluation errors and the boxes are given once for each bound, by name."""
    proof, bounded = certificate.proof, sorted(bound.name for bound in certificate.subject.bounds)
    covers = bounded if isinstance(proof, Steps) or certificate.subject.pieces else sorted(proof.boxes)
    if not bounded:
        raise FailedStepError("names: nothing is bounded, so there is nothing to prove")
    if len(set(bounded)) != len(bounded) or sorted(certificate.errors) != bounded or covers != bounded:
        raise FailedStepError(
            "names: bounds must have different names; evaluation errors and boxes must be given once for each of these"
        )


def _check_weights(subject: Subject, trajectories: Trajectories) -> None:
    if (len(trajectories.states), len(trajectories.inputs)) != (len(subject.system.states), len(subject.system.inputs)):
        raise FailedStepError("shapes: `trajectories` must have an entry for each state and each input")
    for parts in (trajectories.states, trajectories.inputs):
        shifts = [len(weights) for weights in parts[0].weights]
        if len(shifts) != subject.signal_count or any([len(w) for w in part.weights] != shifts for part in parts):
            raise FailedStepError(
                "shapes: for each signal, all states need the same number of weights, and so do all inputs"
            )


def _check_formulas(subject: Subject, system: NonlinearSystem) -> None:
    if system.flat is not None:
        _check_names_of_signals(subject, system.flat)
        return
    n = len(system.states)
    if not len(subject.signals) == n == len(system.inputs):
        raise FailedStepError(
            f"shapes: as many signals and inputs as states are needed, {n}, got {len(subject.signals)} signals and "
            f"{len(system.inputs)} inputs"
        )
    rows = [side.row for side in subject.input_set.rows]
    free = [name for i, name in enumerate(system.inputs) if not any(row[i] for row in rows)]
    if free:  # the formula of an input is shown to be defined only if some row has the input
        raise FailedStepError(f"bounds: every input of a nonlinear system must be bounded, but {free[0]} is not")


def _check_names_of_signals(subject: Subject, flat: FlatForm) -> None:
    try:
        found = [indices(name) for formula in (*flat.states, *flat.inputs, *flat.positive) for name in names(formula)]
    except ValueError as other:
        raise FailedStepError(
            f"flat: formulas must hold shifted signals z1[0], z1[1], … only, but hold {other}"
        ) from None
    if {s for s, _ in flat.indices} != {*range(len(subject.signals))} or max(s for s, _ in found) >= len(
        subject.signals
    ):
        raise FailedStepError("flat: the formulas must contain each signal of the reference, and no others")
    if max(j for _, j in found) > flat.last_shift + 1:
        raise FailedStepError(
            "flat: formulas in `positive` must look no further ahead than those of the states one step later"
        )


def check_trajectories(subject: Subject) -> None:
    """Raise FailedStepError unless x(t + T) = A x(t) + B u(t) + c holds for all signals.

    For a flat form, the equation is x(t + T) = f(x(t), u(t)). A nonlinear system without a flat form is solved for u,
    so that the equation holds.
    """
    system, trajectories = subject.system, subject.trajectories
    if isinstance(system, NonlinearSystem) and system.flat is not None:
        check_flat_form(system, system.flat)
    if not isinstance(system, LinearSystem) or trajectories is None:
        return
    for A, B, c, state in zip(*system.exact, trajectories.states, strict=True):
        x, u = weighted_sum(A, trajectories.states), weighted_sum(B, trajectories.inputs)
        if x.offset + u.offset + c != state.offset:
            raise FailedStepError(
                "trajectories: the constants x_0 and u_0 of states and inputs are no equilibrium of the system"
            )
        for s, weights in enumerate(state.weights):
            earlier = Fraction(0), *weights
            for j, (p, q, r) in enumerate(zip_longest(x.weights[s], u.weights[s], earlier, fillvalue=Fraction(0))):
                tick()
                if p + q != r:
                    raise FailedStepError(
                        f"trajectories: the system does not follow signal {s} with the weights of shift {j}: x(t + T) "
                        "= A x(t) + B u(t) + c fails"
                    )
