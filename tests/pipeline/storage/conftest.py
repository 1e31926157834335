"""A log in a file."""

from pathlib import Path

import pytest

from pipeline.storage.logs import write_log
from tests.pipeline.storage.logs import LOG


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.mcap"


@pytest.fixture
def data(path: Path) -> bytes:
    write_log(path, LOG)
    return path.read_bytes()
