"""Read a counterexample: the only place where its untyped content is looked at."""

from math import inf
from reprlib import repr as short

from trackably.checker.counterexample import FORMAT, VERSION, Counterexample, Instants, Interval
from trackably.checker.reading.names import a_bound
from trackably.checker.reading.subjects import read_subject, subject_fields
from trackably.checker.reading.values import Fields, UnreadableError, positive_number, real_number, tag_of

_CLAIMS: dict[str, tuple[str, ...]] = {"all_times": (), "all_phases": (), "window": ("start", "end"), "instants": ()}
_LATEST_STEP = 2**53


def read_counterexample(data: dict[object, object]) -> Counterexample:
    """Return what a counterexample's JSON says. Raise UnreadableError where it is none of this version."""
    version = data.get("version")
    if type(version) is not int or version != VERSION:
        raise UnreadableError(f"is a counterexample of version {short(version)}; this checker reads version {VERSION}")
    try:
        return _counterexample(data)
    except UnreadableError as error:
        raise UnreadableError(f"is not a {FORMAT.removeprefix('trackably ')}: {error}") from error


def _counterexample(data: dict[object, object]) -> Counterexample:
    about = subject_fields(data)
    content = Fields(data, "counterexample", "format", "version", "claim", *about, "quantity", "at", "violation")
    return Counterexample(
        subject=read_subject(content),
        where=content("at", _at_instant) if _kind(content) == "instants" else _in_interval(content),
        name=content("quantity", a_bound),
        violation=content("violation", positive_number),
    )


def _kind(content: Fields) -> str:
    return content("claim", lambda value, where: tag_of(value, where, "kind", _CLAIMS))


def _in_interval(content: Fields) -> Interval:
    kind = _kind(content)
    claim = content("claim", lambda value, where: Fields(value, where, "kind", *_CLAIMS[kind]))
    start, end = -inf if kind == "all_phases" else 0.0, inf
    if kind == "window":
        start, end = claim("start", real_number), claim("end", real_number)
    at = content("at", lambda value, where: Fields(value, where, "time"))
    return Interval(start, end, at("time", real_number))


def _at_instant(value: object, where: str) -> Instants:
    return Instants(Fields(value, where, "step")("step", _step))


def _step(value: object, where: str) -> int:
    if type(value) is not int or not 0 <= value <= _LATEST_STEP:
        raise UnreadableError(f"{where} must be a whole number from 0 to 2⁵³")
    return value
