"""A real browser opens the logs of experiments with their layout: all topics are listed, and no plot is empty."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipeline.experiments import load_experiment
from pipeline.storage.logs import topics_of
from pipeline.storage.results import Results
from pipeline.viewer.view import shown
from tests.pipeline.viewer import browser
from tests.pipeline.viewer.background import serving
from tests.project import ROOT

EXPERIMENTS = ("example1", "vehicle")
"""One with plots alone, and one with a scene: `test_scene.py` has what all logs have to show."""


class Opened:
    """A page, and what the server has for it: one browser and one address, so that it compiles the viewer once."""

    def __init__(self, page: Any, address: str, served: dict[str, Path | bytes], viewer: Path) -> None:
        self.page, self.address, self._served, self._viewer = page, address, served, viewer
        self.complaints = browser.complaints(page, address)

    def open(self, name: str) -> Results:
        results = Results(name, ROOT / "data" / "results")
        self._served.update(shown(load_experiment(name, ROOT / "params.yaml"), results, self._viewer))
        self.complaints.clear()
        self.page.goto(self.address)
        return results


@pytest.fixture(scope="module")
def opened() -> Iterator[Opened]:
    viewer, served = browser.viewer(), {}
    with serving(served) as address, browser.opened() as page:
        yield Opened(page, address, served, viewer)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_logs_open_with_their_layout(opened: Opened, name: str) -> None:
    results = opened.open(name)
    titles = browser.tabs(opened.page)
    assert {"References", "Margins", "Closed loops"} <= {*titles}
    for title in titles:
        browser.wait_until_drawn(opened.page, title)
    assert sorted(browser.topics(opened.page)) == sorted(topics_of(results))
    assert opened.complaints == []
