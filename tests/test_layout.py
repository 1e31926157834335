"""The house stays small: few files side by side, each of one idea."""

from collections import Counter
from pathlib import Path

from tests.project import ROOT

MOST_FILES, MOST_LINES = 15, 250
BUILDINGS = ("trackable", "pipeline", "tests", "benchmarks")


def sources() -> list[Path]:
    return [path for building in BUILDINGS for path in sorted((ROOT / building).rglob("*.py"))]


def test_no_folder_holds_more_files_than_one_can_take_in():
    by_folder = Counter(path.parent.relative_to(ROOT).as_posix() for path in sources() if path.name != "__init__.py")
    assert len(by_folder) > 40
    assert {folder: count for folder, count in by_folder.items() if count > MOST_FILES} == {}


def test_no_file_holds_more_lines_than_one_idea_takes():
    lines = {
        path.relative_to(ROOT).as_posix(): len(path.read_text(encoding="utf-8").splitlines()) for path in sources()
    }
    assert len(lines) > 300
    assert {name: count for name, count in lines.items() if count > MOST_LINES} == {}
