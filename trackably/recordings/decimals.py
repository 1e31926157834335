"""Numbers as written in a file: kept exactly, and rounded to float64 once, at the end.

Stamps since 1970 have more digits than a float64, and 64.1 mm becomes 0.0641 m only if the product is rounded once.
"""

import math
import re
from decimal import Context, Decimal

from trackably.arguments import is_number
from trackably.errors import InputError

EXACT = Context(prec=1100)
"""Arithmetic with more digits than the difference or product of any two numbers that a file may hold."""

NANOSECOND = Decimal("1e-9")
POINT, COMMA = ".", ","
DECIMAL_MARKS = (POINT, COMMA)

# float() would accept "1_000", "infinity" and digits of any script; an exponent of five digits is no measurement.
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_LONGEST = 1000  # digits, before and behind the point: a float64 has no more, and `EXACT` loses none of so many


def parse(text: str, mark: str) -> Decimal:
    """Read the finite number in `text`, with `mark` in front of the fraction. ValueError: anything else."""
    stripped = text.strip()
    other = COMMA if mark == POINT else POINT
    if _is_number(stripped, mark):
        if not _is_short(number := Decimal(stripped.replace(mark, POINT))):
            raise ValueError(f"expected a number of {_LONGEST} digits at most, got {shorten(text)}")
        return number
    hint = f' (with decimal="{other}" it would be one)' if _is_number(stripped, other) else ""
    raise ValueError(f"expected a number, got {shorten(text)}{hint}")


def exact(value: object) -> Decimal | None:
    """Convert a decoded number without rounding; None and NaN become None. ValueError: it is no finite number."""
    match value:
        case None:
            return None
        case bool() | str() | bytes():
            pass
        case int() | float() | Decimal():
            number = Decimal(value)
            if number.is_nan():
                return None
            if number.is_finite() and _is_short(number):
                return number
    raise ValueError(f"expected a finite number, got {shorten(value)}")


def scale_once(number: Decimal, scale: float, offset: float = 0.0) -> float:
    """Return `number` times `scale` plus `offset` (these as written in decimal), rounded once.

    ValueError: the result is too large for float64.
    """
    product = number if scale == 1 else EXACT.multiply(number, Decimal(repr(float(scale))))
    result = float(EXACT.add(product, Decimal(repr(float(offset)))) if offset else product)
    if math.isinf(result):
        raise ValueError(f"expected a number that fits a float64, got {number:.3e} (times {scale!r})")
    return result


def check_scale(name: str, scale: object, offset: object = 0.0) -> None:
    """Raise InputError if `scale` or `offset` for the values of `name` is no finite number, or the scale is zero."""
    if not is_number(offset) or not math.isfinite(offset):
        raise InputError(f"{name!r}: expected a finite number as offset, got {offset!r}")
    if not is_number(scale):
        raise InputError(f"{name!r}: expected a number as scale, got {scale!r}")
    if not 0 < abs(scale) < math.inf:
        raise InputError(f"{name!r}: expected a scale other than zero, got {scale}")


def plain(number: Decimal) -> str:
    """Format a number for a message: without exponent and trailing zeros."""
    text = f"{number:f}" if abs(number.adjusted()) < 40 else f"{number:.17e}"
    return text.rstrip("0").rstrip(POINT) if POINT in text else text


def shorten(value: object) -> str:
    """Format a decoded value for a message: a number as it was written, anything else shortened."""
    text = str(value) if isinstance(value, Decimal) else repr(value).replace("\n", " ")
    return text if len(text) <= 80 else f"{text[:79]}…"


def _is_short(number: Decimal) -> bool:
    return abs(number.adjusted()) < _LONGEST and len(number.as_tuple().digits) <= _LONGEST


def _is_number(text: str, mark: str) -> bool:
    if mark == COMMA:
        return POINT not in text and _is_number(text.replace(COMMA, POINT), POINT)
    return _NUMBER.fullmatch(text) is not None
