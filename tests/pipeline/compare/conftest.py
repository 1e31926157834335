from pathlib import Path

import pytest

from tests.pipeline.compare.project import build


@pytest.fixture
def base(tmp_path: Path) -> Path:
    return build(tmp_path / "base")


@pytest.fixture
def new(tmp_path: Path) -> Path:
    return build(tmp_path / "new")
