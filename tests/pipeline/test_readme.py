"""What the README shows works as it is shown."""

import json
import math
import re
from pathlib import Path

import pytest

from pipeline.experiments import load_experiment
from tests.project import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_library_example_runs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "measured").mkdir()
    rows = [f"{0.1 * i:.1f},{-math.exp(-0.2 * i):.3f}" for i in range(32)]
    (tmp_path / "measured" / "monday.csv").write_text("\n".join(["t,x", *rows]), encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile("\n".join(blocks), "README.md", "exec"), {})
    said = capsys.readouterr().out
    assert re.match(r"proved for all real t ≥ 0: state in \[.*\], input in \[", said)
    assert "\nProved: For all real t ≥ 0 the reference keeps" in said
    assert (tmp_path / "monday.h").stat().st_size > 1000


def test_the_commands_exist() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"(?:^|`)make (\w+)", README, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


@pytest.mark.parametrize("path", re.findall(r"\]\(([^)#]+)\)", README))
def test_links_lead_somewhere(path: str) -> None:
    assert (ROOT / Path(path)).exists()


def test_the_entry_in_the_guide_is_an_experiment(tmp_path: Path) -> None:
    """Its samples, bounds and prior are those of the guide's own call."""
    cells = json.loads((ROOT / "notebooks" / "guide.ipynb").read_text(encoding="utf-8"))["cells"]
    (block,) = re.findall(r"```yaml\n(.*?)```", "".join(cells[-1]["source"]), re.DOTALL)
    (tmp_path / "params.yaml").write_text(f"experiments:\n{block}", encoding="utf-8")
    experiment = load_experiment("axis", tmp_path / "params.yaml")
    assert experiment.plant.system.states == ("position", "velocity")
    assert experiment.plant.sampling_time == 0.01
