"""Formulas are drawn; `tests/docs` sees that all of the documentation and of the notebooks can be read."""

import re

import pytest

from pipeline.site.extension import drawing


def test_a_formula_is_drawn_as_a_path() -> None:
    assert re.search(r'<path fill="currentColor" d="M[^"]{40,}Z"/>', drawing(r"\tfrac12 x"))


def test_what_cannot_be_read_is_an_error() -> None:
    with pytest.raises(ValueError, match="Unknown symbol"):
        drawing(r"\nosuchcommand{x}")
