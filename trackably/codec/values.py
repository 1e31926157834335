"""Numbers and arrays from JSON, read strictly."""

import re
import sys
from fractions import Fraction
from reprlib import repr as short
from typing import Any

import numpy as np

from trackably.arrays import Array


class CodecError(ValueError):
    """A value cannot be written as JSON, or JSON cannot be read as a value; the message says where ($ is the root)."""


def read_float(value: Any, _: Any) -> float:
    """Return a finite number that float64 holds exactly. Raise CodecError for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise CodecError(f"must be a number, got {short(value)}")
    if not (abs(value) <= sys.float_info.max and float(value) == value):
        raise CodecError(f"must be finite, and exact in float64, got {short(value)}")
    return float(value)


def read_fraction(value: Any, _: Any) -> Fraction:
    """Return the rational number of a text such as -3/4. Raise CodecError for anything else."""
    if not isinstance(value, str) or not re.fullmatch(r"-?[0-9]+(/0*[1-9][0-9]*)?", value):
        raise CodecError(f"must be a rational number such as -3/4, got {short(value)}")
    return Fraction(value)


def read_array(values: Any, _: Any) -> Array:
    """Return numbers in lists as an array; nested lists must have one length. Raise CodecError for anything else."""
    if not isinstance(values, list):
        raise CodecError(f"must be a list of numbers, got {short(values)}")
    items: list[Any] = []
    for i, value in enumerate(values):
        try:
            items.append(read_array(value, float) if isinstance(value, list) else read_float(value, float))
        except CodecError as error:
            raise CodecError(f"[{i}] {error}") from error
    if len({np.shape(item) for item in items}) > 1:
        raise CodecError(f"must be lists of one length, got {short(values)}")
    return np.array(items, dtype=float)
