"""Write CSV text to a file and read it back."""

from pathlib import Path
from typing import Any

from trackably.recordings import Column, CsvLayout, Recording, read_csv

X = {"x": Column("x")}
COMMAS = CsvLayout(decimal=",")
EXPECTED = [(0.0, 1.5), (0.1, -2.0), (0.25, 3e-7)]


def read(path: Path, text: str | bytes, unit: Any = "s", **options: Any) -> Recording:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_csv(path, "t", unit, options.pop("signals", X), **options)


def pairs(recording: Recording, name: str = "x") -> list[tuple[float, float]]:
    return list(zip(recording[name].times.tolist(), recording[name].values.tolist(), strict=True))
