"""Read signals of polynomial pieces."""

from trackably.checker.limits import CENTRES, COEFFICIENTS
from trackably.checker.pieces import Beyond, Pieces
from trackably.checker.reading.values import Fields, many, real_number, tag_of

_BEYOND: dict[str, Beyond] = {"rest": "rest", "period": "period", "end": "end"}


def is_pieces(value: object) -> bool:
    """Whether a signal says that it has breakpoints."""
    return isinstance(value, dict) and "breakpoints" in value


def a_piecewise_signal(value: object, where: str) -> Pieces:
    """Read such a signal."""
    found = Fields(value, where, "breakpoints", "coefficients", "beyond")
    return Pieces(
        found("breakpoints", many(real_number, CENTRES)),
        found("coefficients", many(many(real_number, COEFFICIENTS), CENTRES)),
        _BEYOND[tag_of(value, where, "beyond", _BEYOND)],
    )
