"""No number of the paper is typed by hand, and what it cites is in its bibliography."""

import re

from pipeline.site.build import text_of
from tests.project import ROOT

PAPER = ROOT / "paper"


def test_the_paper_is_its_template_with_numbers_of_results() -> None:
    """The numbers are those of the last `make paper`: while results are moved, the paper may wait."""
    written, now = (PAPER / "paper.md").read_text(encoding="utf-8"), text_of(ROOT)
    assert re.sub(r"[\d.]+", "#", written) == re.sub(r"[\d.]+", "#", now)
    prose = (PAPER / "paper.md.j2").read_text(encoding="utf-8").split("# Summary")[1]
    typed = re.sub(r"\{[{%].*?[%}]\}|@\w+|\$-2 \\ln p\$|!\[.*?\]\(.*?\)", "", prose, flags=re.DOTALL)
    assert re.findall(r"\d+", typed) == []


def test_what_is_cited_is_in_the_bibliography_and_the_other_way_round() -> None:
    text, bibliography = ((PAPER / name).read_text(encoding="utf-8") for name in ("paper.md", "paper.bib"))
    cited, listed = re.findall(r"@(\w+)", text), re.findall(r"^@\w+\{(\w+),", bibliography, re.MULTILINE)
    assert {*cited} == {*listed}
