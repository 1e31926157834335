"""Stages run from outside, as a user runs them, and what they leave behind."""

import os
import subprocess
import sys
from pathlib import Path

from pipeline import ROOT

STAGES = ("generate", "fit", "verify", "figures")


def run(stage: str, folder: Path, experiment: str = "example1", **environment: str) -> subprocess.CompletedProcess[str]:
    """One stage with the parameters in `folder`, warnings being errors; its results go to the folder too."""
    return subprocess.run(
        [
            *(sys.executable, "-W", "error", "-m", "pipeline", stage, experiment),
            *("--params", str(folder / "params.yaml"), "--results", str(folder / "results")),
        ],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def written(folder: Path) -> dict[str, bytes]:
    """Every file of the results but wall clocks, which differ from run to run."""
    results = folder / "results"
    files = (p for p in sorted(results.rglob("*")) if p.is_file() and p.name != "timings.json")
    return {str(p.relative_to(results)): p.read_bytes() for p in files}
