"""What formulas need beside operators to be written once: for numbers of arb, and for arrays of float64 balls."""

from typing import Any, TypeVar

import numpy as np
from flint import arb, arb_series

from trackable.certificates.floats.balls import Balls
from trackable.certificates.floats.series import Series

Number = TypeVar("Number", arb, Balls)
PowerSeries = TypeVar("PowerSeries", arb_series, Series)
_T = TypeVar("_T")


def choose(condition: Any, one: _T, other: Any) -> _T:
    """Return one where the condition holds and the other elsewhere: of numbers, and of arrays one by one."""
    if isinstance(condition, np.ndarray):
        found: Any = (Series if isinstance(one, Series) else Balls).chosen(condition, one, other)  # type: ignore[arg-type]
    else:
        found = one if condition else other
    return found  # type: ignore[no-any-return]


def from_point(start: Number, terms: int) -> Any:
    """Return the power series start + x, or start alone where only one of its `terms` is wanted."""
    if isinstance(start, Balls):
        return Series.of([start, Balls.exact(np.ones_like(start.mid))], terms)
    return arb_series([start, 1], prec=terms)


def zero(like: Number) -> Number:
    """Return the number zero, as often as another number is there."""
    any_kind: Any = like
    found: Any = Balls.exact(np.zeros_like(any_kind.mid)) if isinstance(any_kind, Balls) else arb(0)
    return found  # type: ignore[no-any-return]
