"""A project with one experiment's small results, whose texts would like to run, and the site that is built of it."""

import json
import shutil
import warnings
from pathlib import Path

import pytest
from sphinx.deprecation import RemovedInSphinx11Warning

from pipeline.site.build import build
from tests.pipeline.params import alone, changed
from tests.project import ROOT

NAME = "tank"
HOSTILE = (
    "<script>alert(1)</script> <img src=x onerror=alert(2)> *b* `c` {raw}`d` [e](javascript:alert(3)) $f<g$ &lt; | \\"
    "\n\n```{raw} html\n<script>alert(4)</script>\n```\n\n# h"
)
_FILES = ("summary.json", "metrics.json", "control.json", "margins.csv", "samples.mcap")


@pytest.fixture(scope="session")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Only what is small, so that the pages are built in a second or two."""
    folder = tmp_path_factory.mktemp("project")
    results = Path("data") / "results" / NAME
    for name in (*(results / name for name in _FILES), "benchmarks/README.md", "benchmarks/figures/ratios.svg"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, folder / name)
    for path in ("figures", "certificates"):
        shutil.copytree(ROOT / results / path, folder / results / path)
    title = "A tank between two levels: nonlinear, learned from an MCAP recording"
    params = alone(NAME, changed(NAME, (f'"{title}"', json.dumps(HOSTILE))))
    (folder / "params.yaml").write_text(params, encoding="utf-8")
    value = {"file": f"{NAME}/summary.json", "path": "price_joint"}
    claims = [
        {"claim": text, "source": "own", "value": value, "at_most": most}
        for text, most in ((HOSTILE, 1e6), ("costs | little", 1e6), ("is cheap", -1.0))
    ]
    (folder / "claims.yaml").write_text(json.dumps({"claims": claims}), encoding="utf-8")
    _notebook(folder / "notebooks" / f"{NAME}.ipynb")
    (folder / "docs").mkdir()
    (folder / "docs" / "index.md").write_text("# Docs\n\n```{toctree}\nresults\n```\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def built(project: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the site."""
    output = tmp_path_factory.mktemp("site")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RemovedInSphinx11Warning)  # of a package between Sphinx and this project
        build(project, output)
    return output


def _notebook(path: Path) -> None:
    def markdown(text: str) -> dict[str, object]:
        return {"cell_type": "markdown", "id": f"c{len(text)}", "metadata": {}, "source": [text]}

    table = {"output_type": "execute_result", "execution_count": 1, "metadata": {}, "data": {}}
    table["data"] = {"text/markdown": ["| a | $b$ |\n", "|---|---|\n", "| 1 | 2 |\n"], "text/plain": ["a table"]}
    code = {"cell_type": "code", "id": "code", "metadata": {}, "execution_count": 1, "source": ["evidence()"]}
    cells = [
        markdown("# A story <script>alert(5)</script>\n\nIt has $x(k+1) = 0.9\\,x(k)$.\n\n<p onclick=alert(7)>"),
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
