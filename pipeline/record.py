"""Simulate recordings as sensors would write them: the samples of experiments that are not in the paper.

Real recordings of the same form can replace them: only the name of the file changes in params.yaml.
"""

from pathlib import Path

import numpy as np

from pipeline.storage.logs import Log, Series, write_log
from trackably.arrays import Array
from trackably.files import to_json, write_text

RECORDINGS = Path("data/recordings")
_AXIS_SEED, _BREATHING_SEED, _TANK_SEED = 3, 7, 11


def record(folder: Path = RECORDINGS) -> None:
    """Write all recordings. Raises OSError."""
    write_text(folder / "axis.csv", axis(seed=_AXIS_SEED))
    write_text(folder / "breathing.csv", breathing(seconds=90.0, seed=_BREATHING_SEED))
    write_log(folder / "tank.mcap", tank(seconds=300.0, seed=_TANK_SEED))


def axis(seed: int) -> str:
    """Return a CSV file: the position [mm] of an axis moved by hand to its rest, at times [ms] about 60 ms apart."""
    rng = np.random.default_rng(seed)
    stamps = 60 * np.arange(36) + rng.integers(-9, 10, 36)
    stamps[0] = 0
    left = 1 - np.clip(stamps / 1500, 0, 1)
    positions = -80 * left**3 * (10 - 15 * left + 6 * left**2) + 0.5 * rng.standard_normal(stamps.size)
    rows = (f"{stamp};{position:.1f}".replace(".", ",") for stamp, position in zip(stamps, positions, strict=True))
    return "\n".join(["time [ms];position [mm]", *rows, ""])


def breathing(seconds: float, seed: int) -> str:
    """Return a CSV file as a tracker writes it: the height [mm] of a marker on the abdomen, about every 100 ms.

    Respiratory motion after Lujan et al. (1999) is rest + depth · cos²ⁿ(π t/τ − φ); n = 3 makes exhaling long and
    inhaling short. A slow drift, noise and a resolution of 0.1 mm are added, and faults that such files have: decimal
    commas, a repeated stamp, two rows out of order, and a row at which the marker was lost.
    """
    rng = np.random.default_rng(seed)
    ticks = np.arange(int(10 * seconds))
    stamps = 100 * ticks + rng.integers(-8, 9, ticks.size)
    t = stamps / 1000
    height = 64.0 + 12.0 * np.cos(np.pi * t / 5.4 - 0.6) ** 6
    height = height + 0.8 * np.sin(2 * np.pi * t / 70) + 0.15 * rng.standard_normal(t.size)
    rows = [
        [6 * int(k), int(stamp), 0.1, 0.2, round(float(z), 1)]
        for k, stamp, z in zip(ticks, stamps, height, strict=True)
    ]
    rows[0][1] = 0
    rows[250][1] = rows[249][1]
    rows[400], rows[401] = rows[401], rows[400]
    rows[520][2:] = [0, 0, 0]
    header = ['"Frame"', '"Timestamp"', '"x"', '"y"', '"z"']
    written = [[str(frame), str(stamp), *(f"{v:g}".replace(".", ",") for v in at)] for frame, stamp, *at in rows]
    return "".join(f"{';'.join(cells)}\n" for cells in [header, *written])


def tank(seconds: float, seed: int) -> Log:
    """Return the level [m] of a tank that an operator moves between two setpoints, at uneven times and with noise."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(2.0, 8.0, int(seconds / 5)))
    values = _level(times) + 0.01 * rng.standard_normal(times.size)
    return Log(
        (Series("/tank/level", times, {"level": values}),),
        {"recording": {"unit": "m"}},
        {"recording.json": to_json({"simulated": True})},
    )


def _level(t: Array) -> Array:
    """Return the level [m]: an S from 0.5 m to 1.2 m that begins at 40 s and takes about two minutes."""
    return np.asarray(0.5 + 0.7 / (1 + np.exp(-(t - 110.0) / 14.0)))
