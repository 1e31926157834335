"""A number is rounded once, when it becomes a float64, and only a number is taken for one."""

import re
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.recordings.clocks import exact, parse, scale_once, shorten

FLOATS = st.floats(allow_nan=False, allow_infinity=False)

NUMBERS = {"0": 0.0, "-0": -0.0, "+1.": 1.0, ".5": 0.5, "-484.4": -484.4, " 7 ": 7.0, "1e-3": 1e-3, "5E-324": 5e-324}

NO_NUMBERS = [
    "",
    " ",
    ".",
    "-",
    "1 000",
    "1_000",
    "inf",
    "-Infinity",
    "nan",
    "0x10",
    "1e",
    "1.2.3",
    "٣",
    "−1",
    "1e99999",
]


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("text", NUMBERS)
def test_numbers(text: str, mark: str) -> None:
    assert float(parse(text.replace(".", mark), mark)).hex() == NUMBERS[text].hex()


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("text", NO_NUMBERS)
def test_no_numbers(text: str, mark: str) -> None:
    with pytest.raises(ValueError, match=re.escape(f"expected a number, got {text!r}") + "$"):
        parse(text, mark)


@given(FLOATS)
def test_exact_is_exact(value: float) -> None:
    number = exact(value)
    assert number is not None
    assert Fraction(number) == Fraction(value)
    assert scale_once(number, 1.0).hex() == value.hex()


@given(st.decimals(allow_nan=False, allow_infinity=False, min_value=-1e9, max_value=1e9, places=6))
def test_a_scaled_number_is_rounded_once(number: Decimal) -> None:
    for scale in ("1e-3", "0.1", "-0.3", "1e6"):
        product = Fraction(number) * Fraction(Decimal(scale))
        assert scale_once(number, float(scale)) == float(product)
        for offset in ("273.15", "-0.012"):
            assert scale_once(number, float(scale), float(offset)) == float(product + Fraction(Decimal(offset)))


@pytest.mark.parametrize("value", [True, "1", b"1", float("inf"), Decimal("-Infinity"), [1.0], {"x": 1}])
def test_no_finite_number(value: object) -> None:
    with pytest.raises(ValueError, match=re.escape(f"expected a finite number, got {shorten(value)}")):
        exact(value)
