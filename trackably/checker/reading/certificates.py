"""Read a certificate: the only place where its untyped content is looked at."""

from reprlib import repr as short

from trackably.checker.certificate import (
    VERSION,
    AllPhases,
    AllTimes,
    Boxes,
    Certificate,
    Claim,
    Cover,
    Instants,
    Window,
)
from trackably.checker.limits import BOXES, INSTANTS, TERMS
from trackably.checker.reading.names import a_bound
from trackably.checker.reading.robust import read_robust
from trackably.checker.reading.subjects import read_subject, subject_fields
from trackably.checker.reading.values import (
    Fields,
    UnreadableError,
    by_name,
    many,
    positive_number,
    real_number,
    tag_of,
    whole_number,
)
from trackably.checker.subject import LinearSystem

_CLAIMS: dict[str, tuple[str, ...]] = {
    "all_times": ("tail_start", "covers", "terms"),
    "all_phases": ("period", "covers", "terms"),
    "window": ("start", "end", "covers", "terms"),
    "instants": ("last_step",),
}

_CLAIMS_OF_PIECES = {"all_times": ("tail_start",), "all_phases": ("period",), "window": ("start", "end")}


def read_certificate(data: dict[object, object]) -> Certificate:
    """Return what a certificate's JSON says. Raise UnreadableError where it is none of this version."""
    version = data.get("version")
    if type(version) is not int or version != VERSION:
        raise UnreadableError(
            f"is a certificate of version {short(version)}; this checker reads version {VERSION}: "
            "prove the reference again to get one"
        )
    try:
        return _certificate(data)
    except UnreadableError as error:
        raise UnreadableError(f"is not a certificate: {error}") from error


def _certificate(data: dict[object, object]) -> Certificate:
    disturbed = ["disturbance"] if "disturbance" in data else []
    fields = ("format", "version", "claim", *subject_fields(data), *disturbed, "evaluation")
    content = Fields(data, "certificate", *fields)
    evaluation = content("evaluation", lambda value, where: Fields(value, where, "until", "errors"))
    subject = read_subject(content)
    if disturbed and not isinstance(subject.system, LinearSystem):
        raise UnreadableError("there may be a disturbance for linear systems only")
    return Certificate(
        subject=subject,
        claim=content("claim", _claim_of_pieces if subject.pieces else _claim),
        until=evaluation("until", positive_number),
        errors=evaluation("errors", by_name(a_bound, positive_number)),
        robust=content("disturbance", read_robust) if disturbed else None,
    )


def _claim(value: object, where: str) -> Claim:
    kind = tag_of(value, where, "kind", _CLAIMS)
    found = Fields(value, where, "kind", *_CLAIMS[kind])
    if kind == "instants":
        return Instants(found("last_step", whole_number(INSTANTS)))
    cover = Cover(found("covers", by_name(a_bound, _boxes)), found("terms", whole_number(TERMS)))
    if kind == "window":
        return Window(found("start", real_number), found("end", real_number), cover)
    if kind == "all_phases":
        return AllPhases(found("period", positive_number), cover)
    return AllTimes(found("tail_start", positive_number), cover)


def _claim_of_pieces(value: object, where: str) -> Claim:
    """Read a claim about polynomial pieces: it needs no boxes, and there are no instants alone."""
    kind, none = tag_of(value, where, "kind", _CLAIMS_OF_PIECES), Cover({}, 0)
    found = Fields(value, where, "kind", *_CLAIMS_OF_PIECES[kind])
    if kind == "window":
        return Window(found("start", real_number), found("end", real_number), none)
    if kind == "all_phases":
        return AllPhases(found("period", positive_number), none)
    return AllTimes(found("tail_start", positive_number), none)


def _boxes(value: object, where: str) -> Boxes:
    found = Fields(value, where, "ends", "radii")
    return Boxes(found("ends", many(real_number, BOXES + 1)), found("radii", many(positive_number, BOXES)))
