"""What is loaded: reading CSV needs no MCAP library."""

import subprocess
import sys

import trackably.recordings


def loaded_by(statement: str) -> set[str]:
    """The modules that a new interpreter has loaded after a statement."""
    code = f"{statement}; import sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_csv_without_mcap() -> None:
    modules = loaded_by("from trackably.recordings import read_csv, CsvLayout, Recording")
    assert "trackably.recordings.csv_file" in modules
    assert not modules & {"mcap", "mcap_protobuf", "mcap_ros2", "google.protobuf", "trackably.recordings.mcap_files"}


def test_mcap_on_first_use() -> None:
    assert "mcap" in loaded_by("from trackably.recordings import read_mcap")


def test_all_public_names_are_there() -> None:
    names = trackably.recordings.__all__
    assert len(names) == len(set(names)) == 30
    assert all(getattr(trackably.recordings, name) is not None for name in names)
