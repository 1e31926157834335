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
    """Each in new interpreters; the time of numpy alone beside it."""
    numpy = _seconds("import numpy")
    for statement, target in (("import trackable", 0.5), ("from trackable import learn_reference", None)):
        taken = _seconds(statement)
        middle, parts = median(taken), [second / 0.5 for second in taken]
        rival = "half a second" if target else "half a second (no target)"
        note = f"numpy alone takes {median(numpy):.2f} s"
        found = (middle, 0.5, median(parts), min(parts), max(parts))
        yield Row("import", f"`{statement}`", rival, *found, target=1.0 if target else None, at_most=True, note=note)


def _seconds(statement: str) -> list[float]:
    command = [sys.executable, "-c", _MEASURED.format(statement)]
    runs = [subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True) for _ in range(_ROUNDS)]
    return np.array([float(run.stdout) for run in runs[1:]]).tolist()
