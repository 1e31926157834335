"""The checker shares nothing with what it checks: every import of every file is on a short list.

NumPy is for the first pass in float64 alone, which nothing else needs.
"""

import sys

import pytest

from tests.imports import imported
from tests.project import ROOT

ALLOWED = {*sys.stdlib_module_names, "mpmath"}
FILES = {"importlib", "io", "os", "pathlib", "zipfile"}
IMPORTS = imported(ROOT / "trackably/checker")


def test_every_file_of_the_checker_is_looked_at() -> None:
    assert len(IMPORTS) == len([*(ROOT / "trackably/checker").rglob("*.py")]) >= 15
    assert sum(map(len, IMPORTS.values())) >= 50


@pytest.mark.parametrize("file", IMPORTS)
def test_only_the_command_line_knows_files_and_only_floats_knows_numpy(file: str) -> None:
    allowed = ALLOWED if file == "__main__.py" else ALLOWED - FILES
    if file.startswith("floats/"):
        allowed |= {"numpy"}
    others = {name for name in IMPORTS[file] if not f"{name}.".startswith("trackably.checker.")}
    assert {name.split(".")[0] for name in others} <= allowed


def test_only_the_checker_itself_knows_the_first_pass() -> None:
    knowing = {file for file in IMPORTS for name in IMPORTS[file] if name.startswith("trackably.checker.floats")}
    assert {file for file in knowing if not file.startswith("floats/")} == {"__init__.py"}
