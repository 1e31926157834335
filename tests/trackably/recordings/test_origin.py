"""An origin is a number of nanoseconds, the first sample, or nothing; and is told so that people can read it."""

from typing import Any

import numpy as np
import pytest

from trackably.errors import InputError
from trackably.recordings.clocks import checked_origin, describe_origin

NS = 1772442900_090000000


@pytest.mark.parametrize("origin", [None, "first", 0, -5, NS])
def test_origins(origin: Any) -> None:
    assert checked_origin(origin) == origin


@pytest.mark.parametrize("origin", ["nonsense", "0", "First", "", 0.0, 1.5e9, float("nan"), np.float64(1), True, [0]])
def test_no_origin(origin: Any) -> None:
    with pytest.raises(InputError) as caught:
        checked_origin(origin)
    assert str(caught.value) == (
        f'origin: expected a whole number of nanoseconds, "first" (the first sample of all) or None, got {origin!r}'
    )


@pytest.mark.parametrize(
    ("origin", "seconds"), [(0, "0"), (184_230_400_000, "184.2304"), (-1, "-0.000000001"), (10**40, "1" + "0" * 31)]
)
def test_seconds(origin: int, seconds: str) -> None:
    assert describe_origin(origin, absolute=False) == f"{seconds} s on the file's own clock"
