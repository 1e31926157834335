"""The report says what the results say, and shows texts as texts; `tests/docs` follows its links."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

from tests.pipeline.site.conftest import HOSTILE, NAME


def page(built: Path, name: str) -> str:
    return (built / f"{name}.html").read_text(encoding="utf-8")


def words(html: str) -> str:
    return " ".join(re.sub(r"<[^>]+>", " ", html).split())


def test_the_front_page_has_every_claim_and_its_state(built: Path) -> None:
    told = words(page(built, "results"))
    assert "2 of 3 claims hold" in told
    assert re.search(r"costs \| little own .*? holds", told)
    assert re.search(r"is cheap own .*? fails", told)


def test_the_page_of_an_experiment_tells_proofs_and_offers_files(built: Path, project: Path) -> None:
    told = words(page(built, NAME))
    metrics = json.loads((project / "data" / "results" / NAME / "metrics.json").read_text(encoding="utf-8"))
    for method, found in metrics.items():
        assert f"{method} : {found['proof']}" in told
    offered = {path.name for path in (built / "_downloads").rglob("*.*")}
    assert {"joint.json", "unconstrained.counterexample.json", "samples.mcap"} <= offered
    drawn = {path.name for path in (project / "data" / "results" / NAME / "figures").iterdir()}
    assert drawn <= {path.name for path in (built / "_images").iterdir()}
    assert 'src="_images/tracking.svg"' in page(built, f"notebook-{NAME}"), (
        "a figure of the experiment, where the site has it"
    )


class Elements(HTMLParser):
    """All elements of a page with their attributes, and its text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data


def test_pages_show_what_titles_say_and_run_none_of_it(built: Path) -> None:
    for page in built.rglob("*.html"):
        elements = Elements(page.read_text(encoding="utf-8"))
        for tag, attributes in elements.found:
            assert not [name for name in attributes if name.startswith("on")], (page.name, tag)
            assert not str(attributes.get("href")).startswith("javascript:"), (page.name, tag)
            assert attributes.get("src") != "x", page.name
        scripts = re.findall(r"<script[^>]*>(.*?)</script>", page.read_text(encoding="utf-8"), re.DOTALL)
        assert not [script for script in scripts if "alert(" in script], page.name
        if page.stem in ("results", NAME):
            assert " ".join(HOSTILE.split()) in " ".join(elements.text.split())
