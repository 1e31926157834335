"""Formulas are parsed once, and look as if they were parsed every time."""

import pytest
from matplotlib.font_manager import FontProperties
from matplotlib.mathtext import MathTextParser

from trackably.exports import figures as formulas
from trackably.exports.figures import parsed_once

SMALL, LARGE = FontProperties(size=7), FontProperties(size=8)
CASES = [(text, dpi, font) for text in ("$k$", r"$\theta_1$") for dpi in (72, 144) for font in (SMALL, LARGE)]


def sizes() -> list[tuple[float, ...]]:
    return [tuple(MathTextParser("path").parse(text, dpi, font)[:3]) for text, dpi, font in CASES]


def test_a_formula_is_the_same_as_if_it_were_parsed_again() -> None:
    expected = sizes()
    with parsed_once():
        assert sizes() == sizes() == expected
    assert len({*expected}) == len(CASES)


def test_parsers_share_what_they_parsed_and_only_inside() -> None:
    original = MathTextParser.parse
    with parsed_once():
        once = MathTextParser("path").parse("$k$", 72, SMALL)
        assert MathTextParser("path").parse("$k$", 72, SMALL) is once
    assert MathTextParser.parse is original


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formulas, "_parsed", {})
    monkeypatch.setattr(formulas, "_MOST", 3)
    with parsed_once():
        sizes()
    assert len(formulas._parsed) <= 3
