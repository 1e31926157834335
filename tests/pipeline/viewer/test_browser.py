"""A real browser opens the logs of an experiment with their layout: all topics are listed, and no plot is empty."""

from pipeline.experiments import load_experiment
from pipeline.storage.logs import topics_of
from pipeline.storage.results import Results
from pipeline.viewer.view import shown
from tests.pipeline.viewer import browser
from tests.pipeline.viewer.background import serving
from tests.project import ROOT


def test_logs_open_with_their_layout() -> None:
    """Of one that has a scene beside its plots; `test_scene.py` has what all logs have to show."""
    results, viewer = Results("mobile-robot", ROOT / "data" / "results"), browser.viewer()
    served = shown(load_experiment("mobile-robot", ROOT / "params.yaml"), results, viewer)
    with serving(served) as address, browser.opened() as page:
        complaints = browser.complaints(page, address)
        page.goto(address)
        titles = browser.tabs(page)
        assert {"References", "Margins", "Closed loops"} <= {*titles}
        for title in titles:
            browser.wait_until_drawn(page, title)
        assert sorted(browser.topics(page)) == sorted(topics_of(results))
        assert complaints == []
