"""The checker runs by itself, as one file on a bare Python."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.bundle import write_bundle
from tests.trackably.checker.changes import changed
from tests.trackably.checker.files import file_of
from tests.trackably.checker.tight import VALID

KINDS = [*VALID, "tank", "redundant inputs in the plane", "pushed cart"]


@pytest.fixture(scope="module")
def bundle(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("alone") / "checker.pyz"
    write_bundle(path)
    return path


def run(*arguments: str | Path, **options) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False, **options)


def written(data: object, path: Path) -> Path:
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


# The checker's command line on one file after the other, and its exit codes: Python starts once for all of them.
ONE_BY_ONE = """
import runpy, sys
bundle, *files = sys.argv[1:]
for file in files:
    sys.argv[1:] = [file]
    try:
        runpy.run_path(bundle, run_name="__main__")
    except SystemExit as ended:
        print("exit code", ended.code)
"""


def test_one_file_checks_every_kind_on_a_bare_python_and_a_refusal_has_its_exit_code_and_words(bundle, tmp_path):
    files = [written(file_of(kind), tmp_path / f"{kind}.json") for kind in KINDS]
    narrow = written(changed(file_of("scalar"), "reference.plant.state_set.upper.0", 0.1), tmp_path / "narrow")
    found = run("-I", "-S", "-c", ONE_BY_ONE, bundle, *files, narrow, cwd=tmp_path, env={})
    *said, ended = found.stdout.splitlines()
    assert said[1::2] == ["exit code 0"] * len(KINDS)
    assert all(line.startswith("For all ") for line in said[::2])
    assert (found.returncode, ended) == (0, "exit code 1")
    assert found.stderr.startswith(f"failed: {narrow}: the certificate does not prove its claim: box: the state")
    assert run("-I", "-S", bundle).returncode == 2


def test_its_bytes_are_the_same_each_time(bundle, tmp_path):
    write_bundle(tmp_path / "again.pyz")
    assert (tmp_path / "again.pyz").read_bytes() == bundle.read_bytes()
