"""A stamp keeps every digit, whatever it counts."""

from decimal import Decimal

import pytest

from trackably.recordings.clocks import CLOCKS, frames

TICKS = {
    "s": ("12.7", "12.7"),
    "ms": ("25.6", "0.0256"),
    "us": ("3", "0.000003"),
    "µs": ("3", "0.000003"),
    "ns": ("1700000000123456789", "1700000000.123456789"),
    "min": ("1.5", "90"),
    "h": ("0.25", "900"),
    "epoch s": ("1700000000.123456789012", "1700000000.123456789012"),
    "epoch ms": ("1700000000123.4", "1700000000.1234"),
    "epoch us": ("1700000000123456", "1700000000.123456"),
    "epoch ns": ("1700000000123456789", "1700000000.123456789"),
}


@pytest.mark.parametrize("name", TICKS)
def test_ticks(name):
    clock = CLOCKS[name]
    written, seconds = TICKS[name]
    assert clock.seconds(Decimal(written)) == Decimal(seconds)
    assert clock.absolute == name.startswith("epoch")


def test_frames():
    assert float(frames(60).seconds(Decimal(768))) == 12.8
    assert float(frames(29.97).seconds(Decimal(2997))) == 100.0
