"""Small recordings of one motion to rest, and fleets learned from them."""

from pathlib import Path
from typing import Any

import numpy as np

from tests.trackably.plants import SCALAR as PLANT
from trackably import Fleet, Samples, SquaredExponential, learn_many
from trackably.errors import InputError

KERNEL = SquaredExponential()


def motion(seed: int) -> Samples:
    draw = np.random.default_rng(seed)
    times = 0.1 * np.arange(6)
    return Samples(times, -np.exp(-8 * (1 + 0.1 * draw.random()) * times) + 0.01 * draw.standard_normal(6))


TWO_MOTIONS = {f"run {i}": motion(i) for i in range(2)}


def unreadable() -> Samples:
    raise InputError("a.csv: there is no such file")


def learned(recordings: Any, folder: Path, claim: Any = "all_times", kernel: Any = KERNEL, **options: Any) -> Fleet:
    return learn_many(recordings, PLANT, kernel, claim, folder=folder, **{"noise_std": 0.01, **options})


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
