"""The whole site, as `make docs` builds it: without a warning, and every link leads to a page and a place on it."""

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


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    output = tmp_path_factory.mktemp("docs")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RemovedInSphinx11Warning)  # of a package between Sphinx and this project
        return output, build(ROOT, output)


class Page(HTMLParser):
    """The links, pictures and places of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path, self.links, self.places = path, [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.places.add(given.get("id"))
        if target := given.get("href" if tag == "a" else "src"):
            self.links.append(target)


def test_sphinx_warns_of_nothing(site: tuple[Path, list[str]]) -> None:
    assert site[1] == []


def test_every_link_leads_to_a_page_and_a_place_on_it(site: tuple[Path, list[str]]) -> None:
    pages = {path: Page(path) for path in site[0].rglob("*.html")}
    assert len(pages) > 50
    broken = []
    for path, page in pages.items():
        for link in page.links:
            if re.match(r"[a-z]+:", link):
                continue
            to, _, place = unquote(link).partition("#")
            target = (path.parent / to.partition("?")[0]).resolve() if to else path
            if not target.exists() or (place and target in pages and place not in pages[target].places):
                broken.append((path.relative_to(site[0]).as_posix(), link))
    assert broken == []


def test_docstrings_are_shown_as_they_are_written() -> None:
    (line,) = as_restructured_text(["|x_| ≤ `x_r`[i], *t.shape"])
    assert line == r"\|x\_\| ≤ \ ``x_r``\ [i], \*t.shape"
