"""Read a table."""

from reprlib import repr as short

from trackably.checker.limits import COORDINATES, INSTANTS
from trackably.checker.reading.subjects import a_polytope, a_system
from trackably.checker.reading.values import Fields, UnreadableError, many, positive_number, real_number
from trackably.checker.table import VERSION, Part, RefutedTable, Table

_LATEST_STEP = 2**53
_PARTS: tuple[Part, ...] = ("states", "inputs", "dynamics")


def read_table(data: dict[object, object]) -> Table:
    """Return what a table's JSON says. Raise UnreadableError where it is none of this version."""
    version = data.get("version")
    if type(version) is not int or version != VERSION:
        raise UnreadableError(f"is a table of version {short(version)}; this checker reads version {VERSION}")
    return _table(Fields(data, "table", "format", "version", "table", "plant", "tolerance"))


def read_refuted_table(data: dict[object, object]) -> RefutedTable:
    """Return what a refuted table's JSON says. Raise UnreadableError where it is none of this version."""
    version = data.get("version")
    if type(version) is not int or version != VERSION:
        raise UnreadableError(f"is a refuted table of version {short(version)}; this checker reads version {VERSION}")
    content = Fields(data, "table", "format", "version", "table", "plant", "tolerance", "at")
    at = content("at", lambda value, where: Fields(value, where, "step", "part", "index", "violation"))
    return RefutedTable(
        _table(content), at("step", _step), at("part", _part), at("index", _step), at("violation", positive_number)
    )


def _table(content: Fields) -> Table:
    table = content("table", lambda value, where: Fields(value, where, "first_step", "states", "inputs"))
    plant = content("plant", lambda value, where: Fields(value, where, "system", "state_set", "input_set"))
    rows = many(many(real_number, COORDINATES), INSTANTS)
    return Table(
        table("first_step", _step),
        table("states", rows),
        table("inputs", rows),
        plant("system", a_system),
        plant("state_set", a_polytope),
        plant("input_set", a_polytope),
        content("tolerance", positive_number),
    )


def _part(value: object, where: str) -> Part:
    found: Part | None = next((part for part in _PARTS if part == value), None)
    if found is None:
        raise UnreadableError(f"{where} must be one of {', '.join(_PARTS)}, got {short(value)}")
    return found


def _step(value: object, where: str) -> int:
    if type(value) is not int or abs(value) > _LATEST_STEP:
        raise UnreadableError(f"{where} must be a whole number up to 2⁵³")
    return value
