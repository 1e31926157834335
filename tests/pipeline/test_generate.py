"""The generate stage: what samples it refuses."""

from pathlib import Path

import pytest

from tests.pipeline.command import refused
from tests.pipeline.params import changed, written_to
from tests.pipeline.stages import run_here

BAD_SAMPLES = {
    "not finite": ("k,y\n0,1\n10,inf\n20,0\n", "line 3"),
    "too few": ("k,y\n0,1\n", "at least as many"),
    "negative times": ("k,y\n-5,1\n10,0\n20,0\n", "negative"),
}


@pytest.mark.parametrize(("text", "names"), BAD_SAMPLES.values(), ids=BAD_SAMPLES)
def test_unusable_samples_are_one_sentence(text: str, names: str, tmp_path: Path) -> None:
    (tmp_path / "samples.csv").write_text(text)
    written_to(tmp_path, changed("example1").replace("data/paper/example1_samples.csv", str(tmp_path / "samples.csv")))
    refused(run_here("generate", tmp_path), names)
    assert not (tmp_path / "results").exists()
