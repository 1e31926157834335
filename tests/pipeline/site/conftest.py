"""A project with one experiment's small results, whose texts would like to run, and the site that is built of it."""

import json
import shutil
import warnings
from pathlib import Path

import pytest
from sphinx.deprecation import RemovedInSphinx11Warning

from pipeline.site.build import build
from tests.pipeline.params import changed
from tests.project import ROOT

NAME = "tank"
HOSTILE = (
    "<script>alert(1)</script> <img src=x onerror=alert(2)> *b* `c` {raw}`d` [e](javascript:alert(3)) $f<g$ &lt; | \\"
    "\n\n```{raw} html\n<script>alert(4)</script>\n```\n\n# h"
)


@pytest.fixture(scope="session")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Only what is small, so that the pages are built in a second or two."""
    folder = tmp_path_factory.mktemp("project")
    results = Path("data") / "results" / NAME
    shutil.copytree(ROOT / results, folder / results, ignore=shutil.ignore_patterns("[!s]*.mcap"))
    (folder / "notebooks").mkdir()
    shutil.copy(ROOT / "notebooks" / f"{NAME}.ipynb", folder / "notebooks")
    title = "A tank between two levels: nonlinear, learned from an MCAP recording"
    params = changed(NAME, (f'"{title}"', json.dumps(HOSTILE)))
    (folder / "params.yaml").write_text(params, encoding="utf-8")
    value = {"file": f"{NAME}/summary.json", "path": "price_joint"}
    claims = [
        {"claim": text, "source": "own", "value": value, "at_most": most}
        for text, most in ((HOSTILE, 1e6), ("costs | little", 1e6), ("is cheap", -1.0))
    ]
    (folder / "claims.yaml").write_text(json.dumps({"claims": claims}), encoding="utf-8")
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
