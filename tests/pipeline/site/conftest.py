"""A project with one experiment's small results and notebook, and the site that is built of it."""

import json
import shutil
import warnings
from pathlib import Path

import pytest
from sphinx.deprecation import RemovedInSphinx11Warning

from pipeline.site.build import build
from tests.project import ROOT

NAME = "tank"
_FILES = ("summary.json", "metrics.json", "control.json", "margins.csv", "samples.mcap")


@pytest.fixture(scope="session")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Only what is small, so that the pages are built in a second or two."""
    folder = tmp_path_factory.mktemp("project")
    for name in _FILES:
        _copy(f"data/results/{NAME}/{name}", folder)
    for path in ("figures", "certificates"):
        shutil.copytree(ROOT / "data" / "results" / NAME / path, folder / "data" / "results" / NAME / path)
    params = (ROOT / "params.yaml").read_text(encoding="utf-8").split("\nexperiments:\n")[1]
    entry = params[params.index(f"\n  {NAME}:\n") :]
    later = entry.find("\n\n  ", 3)
    (folder / "params.yaml").write_text(f"experiments:\n{entry if later < 0 else entry[:later]}\n", encoding="utf-8")
    claim = {
        "claim": "costs | little",
        "source": "own",
        "value": {"file": f"{NAME}/summary.json", "path": "price_joint"},
    }
    bounds = [{**claim, "at_most": 1e6}, {**claim, "claim": "is cheap", "at_most": -1.0}]
    (folder / "claims.yaml").write_text(json.dumps({"claims": bounds}), encoding="utf-8")
    _notebook(folder / "notebooks" / f"{NAME}.ipynb")
    (folder / "docs").mkdir()
    (folder / "docs" / "index.md").write_text("# Docs\n\n```{toctree}\nresults\n```\n", encoding="utf-8")
    _copy("benchmarks/README.md", folder)
    _copy("benchmarks/figures/ratios.svg", folder)
    _copy("data/recordings/tank.mcap", folder)
    return folder


@pytest.fixture(scope="session")
def built(project: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The folder of the site, and what Sphinx warned of."""
    output = tmp_path_factory.mktemp("site")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RemovedInSphinx11Warning)  # of a package between Sphinx and this project
        return output, build(project, output)


def _copy(name: str, folder: Path) -> None:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(ROOT / name, folder / name)


def _notebook(path: Path) -> None:
    def markdown(text: str) -> dict[str, object]:
        return {"cell_type": "markdown", "id": f"c{len(text)}", "metadata": {}, "source": [text]}

    table = {"output_type": "execute_result", "execution_count": 1, "metadata": {}, "data": {}}
    table["data"] = {"text/markdown": ["| a | $b$ |\n", "|---|---|\n", "| 1 | 2 |\n"], "text/plain": ["a table"]}
    code = {"cell_type": "code", "id": "code", "metadata": {}, "execution_count": 1, "source": ["evidence()"]}
    cells = [
        markdown("# A story\n\nIt has $x(k+1) = 0.9\\,x(k)$."),
        {**code, "id": "table", "outputs": [table]},
        markdown("The end.\n\n## Where the paper must be read with care\n\n**A sign** is $\\underline\\tau \\ge 0$."),
        {**code, "outputs": [{"output_type": "stream", "name": "stdout", "text": ["evidence of it\n"]}]},
        markdown("## After it\n\nNot about the paper."),
    ]
    kernel = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    path.parent.mkdir(parents=True)
    path.write_text(
        json.dumps({"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}), encoding="utf-8"
    )
