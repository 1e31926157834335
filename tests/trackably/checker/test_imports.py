"""The checker shares nothing with what it checks: every import of every file is on a short list.

NumPy is for the first pass in float64 alone, which nothing else needs.
"""

import sys

import pytest

from tests.imports import imported
from tests.project import ROOT

ALLOWED = {*sys.stdlib_module_names, "mpmath"}
IMPORTS = imported(ROOT / "trackably/checker")


def test_every_file_of_the_checker_is_looked_at() -> None:
    assert len(IMPORTS) == len([*(ROOT / "trackably/checker").rglob("*.py")]) >= 15
    assert sum(map(len, IMPORTS.values())) >= 50


@pytest.mark.parametrize("file", sorted(IMPORTS.keys() - {"__main__.py", "bundle.py"}))
def test_only_the_command_line_and_the_bundle_know_files(file: str) -> None:
    assert {name.split(".")[0] for name in IMPORTS[file]} & {
        "importlib",
        "io",
        "os",
        "pathlib",
        "zipfile",
    } == set()


@pytest.mark.parametrize("file", IMPORTS)
def test_it_imports_itself_the_standard_library_and_mpmath(file: str) -> None:
    allowed = ALLOWED | {"numpy"} if file.startswith("floats/") else ALLOWED
    strangers = {
        name
        for name in IMPORTS[file]
        if name.split(".")[0] not in allowed and not f"{name}.".startswith("trackably.checker.")
    }
    assert strangers == set()


def test_only_the_checker_itself_knows_the_first_pass() -> None:
    knowing = {file for file in IMPORTS for name in IMPORTS[file] if name.startswith("trackably.checker.floats")}
    assert {file for file in knowing if not file.startswith("floats/")} == {"__init__.py"}
