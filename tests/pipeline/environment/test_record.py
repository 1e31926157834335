"""What results were made with."""

import subprocess
import sys

from tests.project import ROOT


def test_it_does_not_depend_on_what_else_is_loaded() -> None:
    """Solvers that nothing here uses bring a BLAS of their own."""
    load = "import pipeline; from pipeline.environment import environment; "
    told = [
        subprocess.run(
            [sys.executable, "-c", f"{load}{more}; print(environment())"],
            cwd=ROOT,
            check=True,
            capture_output=True,
        ).stdout
        for more in (
            "pass",
            "import scs, scipy.linalg, threadpoolctl as t; assert len(t.threadpool_info()) == 3",
        )
    ]
    assert told[0] == told[1]
