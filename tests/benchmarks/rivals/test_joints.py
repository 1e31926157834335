"""Motions of joints by others: the page has what was measured, and a row says what the library answers."""

from benchmarks.rivals import joints, page
from benchmarks.rivals.tables import read


def test_the_page_has_the_rows_that_were_written() -> None:
    assert joints.page(read(joints.Row, page.JOINTS)) in page.PAGE.read_text(encoding="utf-8")
