"""Where recordings come from: files of a folder, or of a pattern."""

from pathlib import Path

import pytest

from trackably import Recording, read_csv, recordings_in


def read(path: Path) -> Recording:
    return read_csv(path, "t", "s", {"position": "x"})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.csv", "b.csv", "deeper/a.csv"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("t,x\n0,1\n1,2\n")
    (tmp_path / ".hidden.csv").write_text("")
    (tmp_path / "notes.txt").write_text("")
    return tmp_path


def test_a_folder_or_a_pattern_names_its_files(folder):
    assert [s.name for s in recordings_in(folder / "*.csv", read)] == ["a", "b"]
    assert [s.name for s in recordings_in(str(folder / "**" / "*.csv"), read)] == ["a", "b", "deeper/a"]
    assert [s.name for s in recordings_in(folder, read)] == ["a", "b", "notes"]
    assert [s.name for s in recordings_in(folder / "a.csv", read)] == ["a"]
    found = recordings_in(folder / "*.csv", read)[0].read()
    assert isinstance(found, Recording)
    assert found["position"].values.tolist() == [1, 2]
