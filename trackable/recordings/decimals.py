"""Numbers as they stand in a file: kept exactly until the one rounding that makes a float64 of them.

Stamps since 1970 have more digits than a float64, and 64.1 mm are 0.0641 m only if the product is rounded once.
"""

import math
import re
from decimal import Context, Decimal

from trackable.errors import InputError

EXACT = Context(prec=1100)
"""More digits than the difference or the product of any two float64 has that a file may hold."""

NANOSECOND = Decimal("1e-9")
POINT, COMMA = ".", ","
DECIMAL_MARKS = (POINT, COMMA)

# float() would take "1_000", "infinity" and digits of any script; an exponent of five digits is no measurement.
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")


def parse(text: str, mark: str) -> Decimal:
    """The finite number that `text` writes with `mark` between its whole part and its fraction; else ValueError."""
    stripped = text.strip()
    other = COMMA if mark == POINT else POINT
    if _is_number(stripped, mark):
        return Decimal(stripped.replace(mark, POINT))
    hint = f' (with decimal="{other}" it would be one)' if _is_number(stripped, other) else ""
    raise ValueError(f"expected a number, got {text!r}{hint}")


def exact(value: object) -> Decimal | None:
    """A decoded number without any rounding; None for nothing and for NaN. ValueError for what is no finite number."""
    match value:
        case None:
            return None
        case bool() | str() | bytes():
            pass
        case int() | float() | Decimal():
            number = Decimal(value)
            if number.is_nan():
                return None
            if number.is_finite():
                return number
    raise ValueError(f"expected a finite number, got {shown(value)}")


def scaled(number: Decimal, scale: float) -> float:
    """`number` times `scale` as that is written, rounded once. ValueError where this is too large for a float64."""
    result = float(number if scale == 1 else EXACT.multiply(number, Decimal(repr(scale))))
    if math.isinf(result):
        raise ValueError(f"expected a number that fits a float64, got {number:.3e} (times {scale!r})")
    return result


def check_scale(name: str, scale: float) -> None:
    """InputError where `scale` makes nothing, or no number, of the values of `name`."""
    if not 0 < abs(scale) < math.inf:
        raise InputError(f"{name!r}: expected a scale other than zero, got {scale}")


def plain(number: Decimal) -> str:
    """A number for a message: without exponent, and without zeros at its end."""
    text = f"{number:f}"
    return text.rstrip("0").rstrip(POINT) if POINT in text else text


def shown(value: object) -> str:
    """A decoded value for a message: a number as it was written, and not too much of anything."""
    text = str(value) if isinstance(value, Decimal) else repr(value).replace("\n", " ")
    return text if len(text) <= 80 else f"{text[:79]}…"


def _is_number(text: str, mark: str) -> bool:
    if mark == COMMA:
        return POINT not in text and _is_number(text.replace(COMMA, POINT), POINT)
    return _NUMBER.fullmatch(text) is not None
