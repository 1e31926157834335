"""How long it takes to load the package, and nothing that only figures or pipelines need."""

import subprocess
import sys
from collections.abc import Iterator
from statistics import median

import numpy as np

from benchmarks.duel import Row
from benchmarks.machine import ROOT

_ROUNDS = 9
_MEASURED = "import time; begin = time.process_time(); {}; print(time.process_time() - begin)"


def rows() -> Iterator[Row]:
    """Time each in new interpreters; NumPy alone stands beside it."""
    numpy = _seconds("import numpy")
    for statement, limit in (("import trackably", 0.05), ("from trackably import learn_reference", 0.4)):
        taken = _seconds(statement)
        parts = [second / limit for second in taken]
        found = (median(taken), limit, median(parts), min(parts), max(parts))
        note = f"numpy alone takes {median(numpy):.2f} s"
        yield Row("import", f"`{statement}`", f"{limit:g} s", *found, target=1.0, at_most=True, note=note)


def _seconds(statement: str) -> list[float]:
    command = [sys.executable, "-c", _MEASURED.format(statement)]
    runs = [subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True) for _ in range(_ROUNDS)]
    return np.array([float(run.stdout) for run in runs[1:]]).tolist()
