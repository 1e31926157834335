"""The same kernels on every machine, chosen before NumPy is loaded."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from pipeline.environment import KERNELS, has_avx2
from tests.project import ROOT

LOOK = """
import json, os
import pipeline
from pipeline.environment import environment
from threadpoolctl import threadpool_info
import scipy.linalg
libraries = [library for library in threadpool_info() if library["user_api"] == "blas"]
print(json.dumps({
    "kernels": sorted({library["architecture"] for library in libraries}),
    "threads": sorted({library["num_threads"] for library in libraries}),
    "libraries": len(libraries),
    "environment": environment(),
}))
"""
needs_avx2 = pytest.mark.skipif(not has_avx2(), reason="nothing is pinned on this processor")


def look(before: str = "", **chosen: str) -> dict[str, Any]:
    """What a new process finds, in an environment that says nothing but what is `chosen`; `before` is done first."""
    inherited = {name: text for name, text in os.environ.items() if name not in {*KERNELS, "OPENBLAS_NUM_THREADS"}}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", f"import pipeline{before}\n{LOOK}"],
        env=inherited | chosen,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return dict(json.loads(done.stdout))


@needs_avx2
def test_a_new_process_takes_the_kernels_of_avx2_and_one_thread_and_records_them_whatever_else_is_loaded() -> None:
    found = look(OPENBLAS_NUM_THREADS="2")
    told = found.pop("environment")
    assert found == {"kernels": ["Haswell"], "threads": [1], "libraries": 2}
    assert told["NumPy's instructions"] == "X86_V3"
    beside_others = look("; import scs")
    assert beside_others["libraries"] == 3, "solvers that nothing here uses bring a BLAS of their own"
    assert beside_others["environment"] == told


@needs_avx2
def test_kernels_that_somebody_names_stay() -> None:
    assert look(OPENBLAS_CORETYPE="Prescott")["kernels"] != ["Haswell"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("flags\t\t: fpu fma avx2 sse\nflags: none\n", True),
        ("flags\t\t: fpu avx2\n", False),
        ("Features: neon\n", False),
    ],
)
def test_processors_without_avx2_are_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, expected: bool
) -> None:
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    (tmp_path / "cpuinfo").write_text(text)
    assert has_avx2(tmp_path / "cpuinfo") is expected
    assert not has_avx2(tmp_path / "no such file")
