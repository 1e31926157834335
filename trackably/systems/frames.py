"""Samples in tables with an index of times, as pandas has them; nothing is imported from there."""

from collections.abc import Iterable
from typing import Protocol, TypeGuard, runtime_checkable

import numpy as np
import numpy.typing as npt

from trackably.arguments import numbers
from trackably.arrays import Array
from trackably.gp.samples import Samples


@runtime_checkable
class Column(Protocol):
    """Values over an index of times: a pandas Series."""

    @property
    def index(self) -> Iterable[object]: ...

    def to_numpy(self) -> npt.NDArray[np.generic]: ...


@runtime_checkable
class Frame(Protocol):
    """Columns of values over one index of times: a pandas DataFrame."""

    @property
    def index(self) -> Iterable[object]: ...

    @property
    def columns(self) -> Iterable[object]: ...

    def __getitem__(self, key: object, /) -> Column: ...


def is_frame(given: object) -> TypeGuard[Frame]:
    """Whether something is a table of columns, as a pandas DataFrame is."""
    return isinstance(given, Frame)


def is_column(given: object) -> TypeGuard[Column]:
    """Whether something is one column with an index, as a pandas Series is."""
    return isinstance(given, Column) and not isinstance(given, Frame)


def samples_of_frame(what: str, frame: Frame) -> dict[str, Samples]:
    """Return the samples of each column by its name, as `samples_of_column` does."""
    return {str(name): samples_of_column(f"{what}[{str(name)!r}]", frame[name]) for name in frame.columns}


def samples_of_column(what: str, column: Column) -> Samples:
    """Return the values of a column at the times [s] of its index; a time without a value (NaN) is no sample.

    Times may be durations (timedelta64). Raises TypeError where they are dates, whose zero would be a guess, and where
    the index only counts rows; ValueError as `Samples` does, with their order.
    """
    times, values = _times(what, column.index), numbers(what, column.to_numpy())
    there = ~np.isnan(values)
    return Samples(times[there], values[there])


def _times(what: str, index: Iterable[object]) -> Array:
    if type(index).__name__ == "RangeIndex":
        raise TypeError(f"{what}: expected an index of times in seconds, got row numbers; see `frame.set_index(times)`")
    times = np.asarray(index)
    if times.dtype.kind == "m":
        times = times / np.timedelta64(1, "s")
    return numbers(f"{what}: index", times)
