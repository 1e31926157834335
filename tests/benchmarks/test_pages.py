"""Pages are what was measured: from the committed numbers come the committed pages, byte by byte."""

import json

from benchmarks import report
from benchmarks.harness import Row
from benchmarks.rivals import page


def test_the_page_of_costs_comes_from_its_numbers():
    written = json.loads(report.RESULTS.read_text(encoding="utf-8"))
    rows = [Row(**row) for row in written["rows"]]
    assert report.table(rows, written["machine"]).encode() == report.TABLE.read_bytes()


def test_the_page_of_rivals_comes_from_its_numbers(tmp_path, monkeypatch):
    before = page.PAGE.read_bytes()
    monkeypatch.setattr(page, "PAGE", tmp_path / "README.md")
    monkeypatch.setattr(page, "FIGURES", tmp_path)
    page.write()
    assert page.PAGE.read_bytes() == before
    assert {path.name for path in tmp_path.glob("*.svg")} == {"violations.svg", "tightness.svg", "study.svg"}
