"""What the documentation shows works as it is shown, its links lead somewhere, and every public name has an example."""

import doctest
import re
import shutil
import tomllib
from pathlib import Path

import pytest

import trackably
from tests.project import ROOT

DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


def blocks(page: Path) -> list[str]:
    return BLOCK.findall(page.read_text(encoding="utf-8"))


def relative(page: Path) -> str:
    return page.relative_to(DOCS).as_posix()


def with_code(examples: bool) -> list[Path]:
    return [page for page in PAGES if any((">>>" in block) is examples for block in blocks(page))]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of a user, with the one file that pages read without writing it."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "data" / "recordings" / "axis.csv", tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", with_code(examples=False), ids=relative)
@pytest.mark.usefixtures("folder")
def test_code_runs_as_it_stands(page: Path) -> None:
    exec(compile("\n".join(blocks(page)), str(page), "exec"), {"__name__": "page"})


@pytest.mark.parametrize("page", with_code(examples=True), ids=relative)
@pytest.mark.usefixtures("folder")
def test_examples_say_what_they_print(page: Path) -> None:
    test = doctest.DocTestParser().get_doctest("\n".join(blocks(page)), {}, page.name, str(page), 0)
    said: list[str] = []
    flags = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    found = doctest.DocTestRunner(optionflags=flags, verbose=False).run(test, out=said.append)
    assert found.attempted
    assert not found.failed, "".join(said)


def test_start_names_the_extras_that_can_be_installed() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    start = (DOCS / "start.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(\w+)` \| ", start, re.MULTILINE)) == set(extras) - {"pipeline"}


def test_every_public_name_is_described_once_with_an_example() -> None:
    described: list[str] = []
    for page in sorted((DOCS / "reference").glob("*.md")):
        for section in re.split(r"^## ", page.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
            names = re.findall(r"^\.\. auto(?:class|function|exception):: trackably\.(\w+)", section, re.MULTILINE)
            (example,) = BLOCK.findall(section)
            assert all(re.search(rf"\b{name}\b", example) for name in names), section
            described += names
    assert sorted(described) == sorted(trackably.__all__)


@pytest.mark.parametrize("page", [*ROOT.glob("[A-Z]*.md")], ids=lambda page: page.name)
def test_files_that_are_linked_are_there(page: Path) -> None:
    """`test_site` follows the links of the documentation."""
    for target in re.findall(r"\]\((?!\w+:)([^)#\s]+)", page.read_text(encoding="utf-8")):
        assert (ROOT / target).exists(), target


def test_commands_that_are_named_exist() -> None:
    targets = re.findall(r"^([\w -]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    there = {target for line in targets for target in line.split()}
    for page in [*PAGES, *ROOT.glob("[A-Z]*.md")]:
        assert {*re.findall(r"(?:^|`)make (\w+)", page.read_text(encoding="utf-8"), re.MULTILINE)} <= there, page
