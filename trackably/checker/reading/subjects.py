"""Read what a file speaks about: a reference, its system and its sets."""

from typing import Any

from trackably.checker.limits import CENTRES, COORDINATES, ROWS, SHIFTS, SIGNALS
from trackably.checker.reading.fingerprint import fingerprint
from trackably.checker.reading.formulas import a_formula, require_short
from trackably.checker.reading.kernels import a_kernel
from trackably.checker.reading.names import an_identifier
from trackably.checker.reading.pieces import a_piecewise_signal, is_pieces
from trackably.checker.reading.values import (
    Fields,
    UnreadableError,
    exact_number,
    many,
    positive_number,
    rational_number,
    real_number,
    whole_number,
)
from trackably.checker.subject import (
    FlatForm,
    Functional,
    LinearSystem,
    NonlinearSystem,
    Polytope,
    Row,
    Signal,
    Subject,
    System,
    Trajectories,
)


def subject_fields(data: dict[object, object]) -> list[str]:
    """Return the names of the fields in which a file says what it is about."""
    return ["reference", *(name for name in ("trajectories", "attainable") if name in data)]


def subject_of(data: dict[Any, Any]) -> Subject:
    """Return what these fields alone say. Raise UnreadableError where they are no subject."""
    return read_subject(Fields(data, "subject", *subject_fields(data)))


def read_subject(content: Fields) -> Subject:
    """Return what these fields say."""
    extra = [name for name in ("trajectories", "attainable") if name in content]
    reference = content("reference", lambda value, where: Fields(value, where, "signals", "plant"))
    plant = reference("plant", lambda value, where: Fields(value, where, "system", "state_set", "input_set"))
    system = plant("system", a_system)
    wanted = ["trajectories"] if isinstance(system, LinearSystem) else []
    if extra[: len(wanted)] != wanted or (not wanted and extra):
        raise UnreadableError("there must be trajectories, and may be attainable rows, for linear systems only")
    kinds = reference("signals", many(lambda value, where: is_pieces(value), SIGNALS))
    pieces = reference("signals", many(a_piecewise_signal, SIGNALS)) if any(kinds) else ()
    trajectories = content("trajectories", _trajectories) if "trajectories" in extra else None
    return Subject(
        signals=() if pieces else reference("signals", many(_signal, SIGNALS)),
        pieces=pieces,
        system=system,
        state_set=plant("state_set", a_polytope),
        input_set=plant("input_set", a_polytope),
        trajectories=trajectories,
        attainable=content("attainable", many(_attainable, ROWS, empty=True)) if "attainable" in extra else None,
        fingerprint=fingerprint(reference("signals", _itself), plant("system", _itself), trajectories),
    )


def _itself(value: object, where: str) -> object:
    return value


def _signal(value: object, where: str) -> Signal:
    found = Fields(value, where, "kernel", "mean", "centres", "weights")
    numbers = many(real_number, CENTRES)
    return Signal(
        found("kernel", a_kernel), found("mean", real_number), found("centres", numbers), found("weights", numbers)
    )


def a_system(value: object, where: str) -> System:
    """Read a system: formulas f make it nonlinear."""
    about, names = ("states", "inputs", "sampling_time"), many(an_identifier, COORDINATES)
    if isinstance(value, dict) and "f" in value:
        found = Fields(value, where, "f", *about, *(name for name in ("flat",) if name in value))
        system = NonlinearSystem(
            found("f", many(a_formula, COORDINATES)),
            found("states", names),
            found("inputs", names),
            found("sampling_time", positive_number),
            found("flat", _flat_form) if "flat" in found else None,
        )
        of_flat = (*system.flat.states, *system.flat.inputs, *system.flat.positive) if system.flat else ()
        require_short((*system.f, *of_flat), where)
        return system
    found, matrix = Fields(value, where, "A", "B", "c", *about), many(many(real_number, COORDINATES), COORDINATES)
    return LinearSystem(
        found("A", matrix),
        found("B", matrix),
        found("c", many(real_number, COORDINATES)),
        found("states", names),
        found("inputs", names),
        found("sampling_time", positive_number),
    )


def _flat_form(value: object, where: str) -> FlatForm:
    more = [name for name in ("angles", "positive") if isinstance(value, dict) and name in value]
    found = Fields(value, where, "states", "inputs", *more)
    formulas = many(a_formula, COORDINATES)
    return FlatForm(
        found("states", formulas),
        found("inputs", formulas),
        found("angles", many(an_identifier, COORDINATES)) if "angles" in found else (),
        found("positive", formulas) if "positive" in found else (),
    )


def a_polytope(value: object, where: str) -> Polytope:
    """Read a set of states or of inputs."""
    found, numbers = Fields(value, where, "rows", "lower", "upper", "dimension"), many(real_number, ROWS, empty=True)
    rows, lower, upper = (
        found("rows", many(many(exact_number, COORDINATES), ROWS, empty=True)),
        found("lower", numbers),
        found("upper", numbers),
    )
    if not len(rows) == len(lower) == len(upper):
        raise UnreadableError(f"{where} must have as many lower and upper bounds as rows")
    return Polytope(tuple(map(Row, rows, lower, upper)), found("dimension", whole_number(COORDINATES)))


def _attainable(value: object, where: str) -> Row:
    found = Fields(value, where, "row", "lower", "upper")
    return Row(
        found("row", many(rational_number, COORDINATES)), found("lower", real_number), found("upper", real_number)
    )


def _trajectories(value: object, where: str) -> Trajectories:
    found = Fields(value, where, "states", "inputs")
    return Trajectories(
        found("states", many(_functional, COORDINATES)), found("inputs", many(_functional, COORDINATES))
    )


def _functional(value: object, where: str) -> Functional:
    found = Fields(value, where, "offset", "weights")
    return Functional(found("offset", rational_number), found("weights", many(many(rational_number, SHIFTS), SIGNALS)))
