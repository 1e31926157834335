"""One version: of the package, of the changelog, and of what is cited."""

import re

import trackably
from tests.project import ROOT


def test_the_newest_version_of_the_changelog_is_that_of_the_package_and_of_the_citation() -> None:
    released = re.findall(
        r"^## \[(\d\S*)\] - (\S+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert released[0][0] == trackably.__version__ == re.search(r"^version: (\S+)$", cited, re.MULTILINE)[1]
    assert released[0][1] == re.search(r"^date-released: (\S+)$", cited, re.MULTILINE)[1]
    assert [date for _, date in released] == sorted((date for _, date in released), reverse=True)
