"""A stamp keeps every digit, whatever it counts."""

from decimal import Decimal

import pytest

from trackably.recordings.clocks import CLOCKS, frames

LENGTHS = {"s": "1", "ms": "0.001", "us": "0.000001", "µs": "0.000001", "ns": "0.000000001", "min": "60", "h": "3600"}


@pytest.mark.parametrize("name", [name for name in CLOCKS if name != "ISO 8601"])
def test_ticks_are_multiplied_by_their_length(name):
    written = Decimal("1700000000.123456789012")
    assert CLOCKS[name].seconds(written) == written * Decimal(LENGTHS[name.removeprefix("epoch ")])
    assert CLOCKS[name].absolute == name.startswith("epoch")


def test_frames():
    assert float(frames(60).seconds(Decimal(768))) == 12.8
    assert float(frames(29.97).seconds(Decimal(2997))) == 100.0
