"""Read a certificate: the only place where its untyped content is looked at."""

from trackable.checker.certificate import (
    FORMAT,
    VERSION,
    AllPhases,
    AllTimes,
    Boxes,
    Certificate,
    Claim,
    Cover,
    Functional,
    Instants,
    LinearSystem,
    NonlinearSystem,
    Polytope,
    Row,
    Signal,
    System,
    Trajectories,
    Window,
)
from trackable.checker.reading.formulas import a_formula
from trackable.checker.reading.kernels import a_kernel
from trackable.checker.reading.values import (
    Fields,
    UnreadableError,
    a_name,
    by_name,
    exact_number,
    many,
    positive_number,
    rational_number,
    real_number,
    tag_of,
    whole_number,
)

_CLAIMS: dict[str, tuple[str, ...]] = {
    "all_times": ("tail_start", "covers", "terms"),
    "all_phases": ("period", "covers", "terms"),
    "window": ("start", "end", "covers", "terms"),
    "instants": ("last_step",),
}


def read_certificate(data: object) -> Certificate:
    """Return what a certificate's JSON says. Raise UnreadableError where it is no certificate of this version."""
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise UnreadableError(f"is not a certificate: certificate.format must be {FORMAT!r}")
    version: object = data.get("version")
    if type(version) is not int or version != VERSION:
        raise UnreadableError(
            f"is a certificate of version {version!r}; this checker reads version {VERSION}: "
            "prove the reference again to get one"
        )
    try:
        return _certificate(data)
    except UnreadableError as error:
        raise UnreadableError(f"is not a certificate: {error}") from error


def _certificate(data: dict[object, object]) -> Certificate:
    extra = [name for name in ("trajectories", "attainable") if name in data]
    content = Fields(data, "certificate", "format", "version", "claim", "reference", *extra, "evaluation")
    reference = content("reference", lambda value, where: Fields(value, where, "signals", "plant"))
    plant = reference("plant", lambda value, where: Fields(value, where, "system", "state_set", "input_set"))
    system = plant("system", _system)
    wanted = ["trajectories"] if isinstance(system, LinearSystem) else []
    if extra[: len(wanted)] != wanted or (not wanted and extra):
        raise UnreadableError("certificate must have trajectories, and may have attainable, for linear systems only")
    evaluation = content("evaluation", lambda value, where: Fields(value, where, "until", "errors"))
    return Certificate(
        claim=content("claim", _claim),
        signals=reference("signals", many(_signal)),
        system=system,
        state_set=plant("state_set", _polytope),
        input_set=plant("input_set", _polytope),
        trajectories=content("trajectories", _trajectories) if "trajectories" in extra else None,
        attainable=content("attainable", many(_attainable)) if "attainable" in extra else None,
        until=evaluation("until", positive_number),
        errors=evaluation("errors", by_name(positive_number)),
    )


def _signal(value: object, where: str) -> Signal:
    found = Fields(value, where, "kernel", "mean", "centres", "weights")
    numbers = many(real_number)
    return Signal(
        found("kernel", a_kernel), found("mean", real_number), found("centres", numbers), found("weights", numbers)
    )


def _system(value: object, where: str) -> System:
    """Formulas f make a system nonlinear."""
    about, names = ("states", "inputs", "sampling_time"), many(a_name)
    if isinstance(value, dict) and "f" in value:
        found = Fields(value, where, "f", *about)
        return NonlinearSystem(
            found("f", many(a_formula)),
            found("states", names),
            found("inputs", names),
            found("sampling_time", positive_number),
        )
    found, matrix = Fields(value, where, "A", "B", "c", *about), many(many(real_number))
    return LinearSystem(
        found("A", matrix),
        found("B", matrix),
        found("c", many(real_number)),
        found("states", names),
        found("inputs", names),
        found("sampling_time", positive_number),
    )


def _polytope(value: object, where: str) -> Polytope:
    found, numbers = Fields(value, where, "rows", "lower", "upper", "dimension"), many(real_number, empty=True)
    rows, lower, upper = (
        found("rows", many(many(exact_number), empty=True)),
        found("lower", numbers),
        found("upper", numbers),
    )
    if not len(rows) == len(lower) == len(upper):
        raise UnreadableError(f"{where} must have as many lower and upper bounds as rows")
    return Polytope(tuple(map(Row, rows, lower, upper)), found("dimension", whole_number))


def _attainable(value: object, where: str) -> Row:
    found = Fields(value, where, "row", "lower", "upper")
    return Row(found("row", many(rational_number)), found("lower", real_number), found("upper", real_number))


def _trajectories(value: object, where: str) -> Trajectories:
    found = Fields(value, where, "states", "inputs")
    return Trajectories(found("states", many(_functional)), found("inputs", many(_functional)))


def _functional(value: object, where: str) -> Functional:
    found = Fields(value, where, "offset", "weights")
    return Functional(found("offset", rational_number), found("weights", many(many(rational_number))))


def _claim(value: object, where: str) -> Claim:
    kind = tag_of(value, where, "kind", _CLAIMS)
    found = Fields(value, where, "kind", *_CLAIMS[kind])
    if kind == "instants":
        return Instants(found("last_step", whole_number))
    cover = Cover(found("covers", by_name(_boxes)), found("terms", whole_number))
    if kind == "window":
        return Window(found("start", real_number), found("end", real_number), cover)
    if kind == "all_phases":
        return AllPhases(found("period", positive_number), cover)
    return AllTimes(found("tail_start", positive_number), cover)


def _boxes(value: object, where: str) -> Boxes:
    found = Fields(value, where, "ends", "radii")
    return Boxes(found("ends", many(real_number)), found("radii", many(positive_number)))
