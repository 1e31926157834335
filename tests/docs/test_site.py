"""The whole site, as `make docs` builds it: without a warning or a network, and every link leads to a place."""

import re
import warnings
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest
from sphinx.deprecation import RemovedInSphinx11Warning

from pipeline.site.build import build
from pipeline.site.extension import as_restructured_text
from tests.project import ROOT


class Page(HTMLParser):
    """The links, assets and places of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links, self.assets, self.places = [], [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.places.add(given.get("id"))
        if target := given.get("href" if tag in ("a", "link") else "src"):
            (self.links if tag == "a" else self.assets).append(target)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str], dict[Path, Page]]:
    """Return the folder of the site, what Sphinx warns of, and all pages."""
    output = tmp_path_factory.mktemp("docs")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RemovedInSphinx11Warning)  # of a package between Sphinx and this project
        told = build(ROOT, output)
    return output, told, {path: Page(path) for path in output.rglob("*.html")}


def test_sphinx_warns_of_nothing(site) -> None:
    assert site[1] == []


def test_no_asset_comes_from_a_network(site) -> None:
    output, _, pages = site
    assets = {asset for page in pages.values() for asset in page.assets}
    assert [asset for asset in assets if re.match(r"(?:\w+:)?//", asset)] == []
    for path in output.rglob("*.css"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", text), path.name


def test_every_link_leads_to_a_page_and_a_place_on_it(site) -> None:
    output, _, pages = site
    assert len(pages) > 50
    broken = []
    for path, page in pages.items():
        for link in page.links + page.assets:
            if re.match(r"[a-z]+:", link):
                continue
            to, _, place = unquote(link).partition("#")
            target = (path.parent / to.partition("?")[0]).resolve() if to else path
            if not target.exists() or (place and target in pages and place not in pages[target].places):
                broken.append((path.relative_to(output).as_posix(), link))
    assert broken == []


def test_notebooks_are_shown_as_they_were_executed(site) -> None:
    html = (site[0] / "notebook-example1.html").read_text(encoding="utf-8")
    assert "<table" in html
    assert "<math" in html


def test_docstrings_are_shown_as_they_are_written() -> None:
    (line,) = as_restructured_text(["|x_| ≤ `x_r`[i], *t.shape"])
    assert line == r"\|x\_\| ≤ \ ``x_r``\ [i], \*t.shape"
