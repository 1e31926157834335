"""The guide's last page shows an entry of params.yaml that is an experiment."""

import json
import re
from pathlib import Path

from pipeline.experiments import load_experiment
from tests.project import ROOT


def test_the_entry_in_the_guide_is_an_experiment(tmp_path: Path) -> None:
    """Its samples, bounds and prior are those of the guide's own call."""
    cells = json.loads((ROOT / "notebooks" / "guide.ipynb").read_text(encoding="utf-8"))["cells"]
    (block,) = re.findall(r"```yaml\n(.*?)```", "".join(cells[-1]["source"]), re.DOTALL)
    (tmp_path / "params.yaml").write_text(f"experiments:\n{block}", encoding="utf-8")
    experiment = load_experiment("axis", tmp_path / "params.yaml")
    assert experiment.plant.system.states == ("position", "velocity")
    assert experiment.plant.sampling_time == 0.01
