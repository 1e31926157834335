"""Formulas are drawn; `tests/docs` sees that all of the documentation and of the notebooks can be read."""

import re

import pytest

from pipeline.site.extension import drawing, known


def test_a_formula_is_drawn_as_a_path() -> None:
    assert re.search(r'<path fill="currentColor" d="M[^"]{40,}Z"/>', drawing(r"\tfrac12 x"))


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
