"""`python -m pipeline view` serves until it is interrupted, and ends quietly."""

import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from pipeline.viewer.view import FETCHED, LOCKED
from tests.project import ROOT


@pytest.fixture
def viewer(tmp_path: Path) -> Path:
    """A folder that looks like the fetched viewer."""
    folder = tmp_path / FETCHED
    (folder / "node_modules/@foxglove/studio-base/assets").mkdir(parents=True)
    (folder / "fetched").write_bytes((LOCKED / "package-lock.json").read_bytes())
    return tmp_path


def test_it_serves_until_it_is_interrupted(viewer: Path) -> None:
    wanted = ["tank", "--params", str(ROOT / "params.yaml"), "--results", str(ROOT / "data" / "results")]
    run = [sys.executable, "-m", "pipeline", "view", *wanted, "--no-browser"]
    with subprocess.Popen(run, cwd=viewer, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        said = process.stdout.readline()
        found = re.fullmatch(r"tank: (http://127\.0\.0\.1:\d+/) until Ctrl-C\n", said)
        assert found, said
        with urllib.request.urlopen(f"{found[1]}about.json") as answer:
            assert b'"name": "tank"' in answer.read()
        process.send_signal(signal.SIGINT)
        try:
            _, complaints = process.communicate(timeout=20)
        finally:
            process.kill()
    assert (process.returncode, complaints) == (0, "")
