"""Formulas are MathML; `tests/docs` sees that all of the documentation and of the notebooks can be read."""

import pytest
from docutils.utils.math import MathError

from pipeline.site.extension import mathml


def test_a_fraction_of_two_digits_has_two_numbers() -> None:
    assert mathml(r"\tfrac12 x").count("<mn>") == 2


def test_what_cannot_be_read_is_an_error() -> None:
    with pytest.raises(MathError, match="nosuchcommand"):
        mathml(r"\nosuchcommand{x}")
