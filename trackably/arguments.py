"""Check arguments of public functions: each error names the argument (`what`), what was expected and what came."""

import math
import reprlib
from decimal import Decimal
from fractions import Fraction
from numbers import Real
from types import UnionType
from typing import TypeGuard

import numpy as np
import numpy.typing as npt

from trackably.arrays import Array

_SECONDS = "(times - times[0]) / np.timedelta64(1, 's') are seconds"


_LONGEST = 200  # most characters of a value in a message
_SHORTENER = reprlib.Repr()
_SHORTENER.maxother = 60  # most characters of other objects, such as dates
_SHORTENER.maxstring = 80  # most characters of a text, such as a cell of a file


def short(value: object) -> str:
    """Return a value as a text in one line for messages: a decimal number as it was written.

    Long lists and texts in it are shortened, and the whole text is cut after 200 characters, a number after 80.
    """
    said, most = _SHORTENER.repr(value).replace("\n", " "), _LONGEST
    if isinstance(value, Decimal):
        said, most = str(value), _SHORTENER.maxstring
    return said if len(said) <= most else f"{said[:most]}…"


def real(what: str, given: object) -> float:
    """Return a finite number as a float. TypeError: `given` is no number. ValueError: it is infinite or NaN."""
    if not is_number(given):
        raise TypeError(f"{what}: expected a number, got {short(given)}")
    number = float(given)
    if not math.isfinite(number):
        raise ValueError(f"{what} must be finite, got {number}")
    return number


def positive(what: str, given: object) -> float:
    """Return a positive number. TypeError: `given` is no number. ValueError: it is not positive, or not finite."""
    if (number := real(what, given)) <= 0:
        raise ValueError(f"{what} must be positive, got {number:g}")
    return number


def whole(what: str, given: object, least: int | None = None, most: int | None = None) -> int:
    """Return a whole number as an int. TypeError: it is not whole. ValueError: it is not between `least` and `most`."""
    if not isinstance(given, int | np.integer) or isinstance(given, bool):
        raise TypeError(f"{what}: expected a whole number, got {short(given)}")
    if least is not None and given < least:
        raise ValueError(f"{what} must be at least {least}, got {given}")
    if most is not None and given > most:
        raise ValueError(f"{what} must be at most {most}, got {short(given)}")
    return int(given)


def text(what: str, given: object) -> str:
    """Return a str. TypeError: `given` is anything else."""
    if not isinstance(given, str):
        raise TypeError(f"{what}: expected a text, got {short(given)}")
    return given


def instance(what: str, given: object, wanted: type | UnionType, described: str) -> None:
    """Raise TypeError if `given` is not of the type `wanted`; the message calls that type `described`."""
    if not isinstance(given, wanted):
        raise TypeError(f"{what}: expected {described}, got {_came(given)}")


def names(what: str, given: object) -> tuple[str, ...]:
    """Return names from a list, tuple or array. TypeError: `given` is a single str, or an entry is no str."""
    if isinstance(given, str) or not isinstance(given, tuple | list | np.ndarray):
        raise TypeError(f"{what}: expected a list of names, got {short(given)}")
    return tuple(text(f"{what}[{i}]", str(name) if isinstance(name, np.str_) else name) for i, name in enumerate(given))


def numbers(what: str, given: npt.ArrayLike) -> Array:
    """Return real numbers, in lists or an array, as a new float64 array; it may hold infinities and NaN.

    TypeError: `given` holds dates, texts, complex numbers or masked values, or its lists differ in length.
    """
    if isinstance(given, np.ma.MaskedArray) and given.mask.any():
        raise TypeError(f"{what}: some values are masked; leave them out, as with `.compressed()`")
    try:
        array = np.array(given)
    except ValueError:  # NumPy raises it if nested lists differ in length
        raise TypeError(f"{what}: expected numbers, in lists of one length, got {short(given)}") from None
    match array.dtype.kind:
        case "b" | "i" | "u" | "f":
            return array.astype(float)
        case "O":
            return _from_objects(what, array)
        case "M" | "m":
            raise TypeError(f"{what}: expected numbers, got {array.dtype}; {_SECONDS}")
        case "c":
            raise TypeError(f"{what}: expected real numbers, got {array.dtype}")
    raise TypeError(f"{what}: expected numbers, got {short(given)}")


def array(what: str, given: npt.ArrayLike, *shape: int | None, advice: str = "") -> Array:
    """Return finite numbers as a read-only array of the given `shape`, in which None stands for any size but 0.

    The message about a number that is not finite ends with `advice`.

    TypeError as for `numbers`. ValueError: the shape differs, or a number is not finite.
    """
    found = numbers(what, given)
    fits = len(found.shape) == len(shape) and all(
        n == want or want is None for n, want in zip(found.shape, shape, strict=False)
    )
    if not fits or not found.size:
        described = ", ".join("≥ 1" if want is None else str(want) for want in shape)
        raise ValueError(f"{what} must have shape ({described}{',' * (len(shape) == 1)}), got shape {found.shape}")
    if not np.all(is_finite := np.isfinite(found)):
        index = np.argwhere(~is_finite)[0].tolist()
        raise ValueError(f"{what}{index or ''} must be finite, got {found[tuple(index)]}{advice}")
    found.flags.writeable = False
    return found


def _from_objects(what: str, array: npt.NDArray[np.object_]) -> Array:
    """Return an array of Python's own numbers, such as `Fraction`, as float64. TypeError: an entry is no number."""
    for index, value in np.ndenumerate(array):
        if not is_number(value):
            place = f"[{', '.join(map(str, index))}]" if index else ""
            hint = f"; {_SECONDS}" if hasattr(value, "year") else ""
            raise TypeError(f"{what}{place}: expected a number, got {short(value)}{hint}")
    return array.astype(float)


def _came(given: object) -> str:
    """Describe a value in an error message: a value of Python's own types as it is, any other by its type."""
    if isinstance(given, type):
        return f"the class {given.__name__}"
    return short(given) if type(given).__module__ == "builtins" else type(given).__name__


def is_number(value: object) -> TypeGuard[float]:
    """Whether `value` is a real number that fits into a float64, rounded if need be; True and False do not count."""
    if isinstance(value, float):  # fast path, as most values are floats
        return True
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real | Decimal | Fraction):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True
