"""Formulas are drawn: all that notebooks contain can be read, and what stands in them is not lost."""

import json
import re

import pytest

from pipeline.site.extension import drawing, known
from tests.project import ROOT

_FORMULA = re.compile(r"\$\$(.+?)\$\$|(?<!\\)\$([^$\n]+)\$", re.DOTALL)


def formulas() -> set[str]:
    found = set()
    for path in sorted((ROOT / "notebooks").glob("*.ipynb")):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            if cell["cell_type"] == "markdown":
                found |= {a or b for a, b in _FORMULA.findall("".join(cell["source"]))}
    return found


def test_every_formula_of_the_notebooks_is_drawn() -> None:
    assert len(formulas()) > 60
    for tex in formulas():
        assert re.search(r'<path fill="currentColor" d="M[^"]{40,}Z"/>', drawing(tex)), tex


@pytest.mark.parametrize(
    ("tex", "expected"),
    [
        (r"a \ge b \le c", r"a \geq b \leq c"),
        (r"\big(x\Big)", "(x)"),
        (r"\tfrac12 x", r"\frac{1}{2} x"),
        (r"\underline\tau T_\mathrm s", r"\underline{\tau} T_\mathrm{s}"),
        (r"0\dots \bar k", r"0\dots \bar{k}"),
        (r"\leq \left", r"\leq \left"),
    ],
)
def test_commands_that_matplotlib_lacks_are_replaced(tex: str, expected: str) -> None:
    assert known(tex) == expected


def test_what_cannot_be_read_is_an_error() -> None:
    with pytest.raises(ValueError, match="Unknown symbol"):
        drawing(r"\nosuchcommand{x}")
