"""The files of one experiment below data/results, which stages write and later stages read, and tables as CSV."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from trackably.arrays import Array
from trackably.recordings.csv_file import CsvLayout, csv_table

ENVIRONMENT = "environment.json"


@dataclass(frozen=True)
class Results:
    """Paths of the files that the stages of an experiment write, below `root`.

    Each log stores the `parameters` of the experiment, so that DVC runs later stages again if they change.
    """

    experiment: str
    root: Path = Path("data/results")
    parameters: str = ""

    @property
    def folder(self) -> Path:
        return self.root / self.experiment

    def log(self, stage: str) -> Path:
        return self.folder / f"{stage}.mcap"

    @property
    def iterations(self) -> Path:
        return self.folder / "iterations.csv"

    @property
    def metrics(self) -> Path:
        return self.folder / "metrics.json"

    @property
    def summary(self) -> Path:
        """The file with the few numbers that summarise the experiment: the metric that DVC shows."""
        return self.folder / "summary.json"

    @property
    def control(self) -> Path:
        return self.folder / "control.json"

    @property
    def layout(self) -> Path:
        """The layout for viewers of the logs."""
        return self.folder / "layout.json"

    @property
    def proofs(self) -> list[Path]:
        """The existing files with certificates and counterexamples."""
        return sorted((self.folder / "certificates").glob("*.json"))

    def certificate(self, method: str) -> Path:
        return self.folder / "certificates" / f"{method}.json"

    @property
    def figures(self) -> Path:
        return self.folder / "figures"

    def figure(self, name: str) -> Path:
        return self.figures / f"{name}.svg"


_TABLES = CsvLayout(separator=",", comment="", missing=("",))
"""The form of CSV files that this pipeline writes, and of published curves."""


def read_numbers(path: Path) -> dict[str, Array]:
    """Return the columns of a CSV file of numbers by name; an empty cell is NaN.

    Raises InputError that names file, line and column.
    """
    table = csv_table(path, _TABLES)
    return {name: table.numbers(name) for name in table.columns}


def to_csv(columns: Mapping[str, Array]) -> str:
    """Return named columns as CSV. Numbers have the fewest digits that give the same float64; NaN is an empty cell."""
    rows = zip(*columns.values(), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(_csv_cell, row)) for row in rows)]) + "\n"


def _csv_cell(value: float) -> str:
    return "" if np.isnan(value) else str(int(value)) if value == int(value) else repr(float(value))
