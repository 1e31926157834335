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

SHOWN_BY = {"example1-resampled": "example1"}
"""Of two experiments with the same plots one is opened: the one with more topics."""
EXPERIMENTS = sorted(path.name for path in (ROOT / "data" / "results").iterdir() if [*path.glob("*.mcap")])


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


@pytest.mark.parametrize("name", [name for name in EXPERIMENTS if name not in SHOWN_BY])
def test_logs_open_with_their_layout(opened: Opened, name: str) -> None:
    results = opened.open(name)
    titles = browser.tabs(opened.page)
    assert {"References", "Margins", "Closed loops"} <= {*titles}
    for title in titles:
        browser.wait_until_drawn(opened.page, title)
    assert sorted(browser.topics(opened.page)) == sorted(topics_of(results))
    assert opened.complaints == []


@pytest.mark.parametrize(("name", "other"), SHOWN_BY.items())
def test_what_is_not_opened_has_nothing_that_the_other_lacks(name: str, other: str) -> None:
    topics = [topics_of(Results(of, ROOT / "data" / "results")) for of in (name, other)]
    assert {*topics[0]} <= {*topics[1]}
