"""A number is rounded once, when it becomes a float64, and only a number is taken for one."""

import re
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.errors import InputError
from trackably.recordings.decimals import check_scale, exact, parse, plain, scaled, shown

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


@pytest.mark.parametrize(("text", "mark", "other"), [("-484,4", ".", ","), ("25.6", ",", ".")])
def test_the_other_mark_is_suggested(text: str, mark: str, other: str) -> None:
    with pytest.raises(ValueError, match=re.escape(f'(with decimal="{other}" it would be one)')):
        parse(text, mark)


@pytest.mark.parametrize("text", ["1.234,5", "1,234.5"])
@pytest.mark.parametrize("mark", [".", ","])
def test_thousands_are_not_guessed(text: str, mark: str) -> None:
    with pytest.raises(ValueError, match=r"expected a number, got '[\d.,]+'$"):
        parse(text, mark)


@given(FLOATS)
def test_text_round_trip(value: float) -> None:
    assert float(parse(repr(value), ".")).hex() == value.hex()
    assert float(parse(repr(value).replace(".", ","), ",")).hex() == value.hex()


@given(FLOATS)
def test_exact_is_exact(value: float) -> None:
    number = exact(value)
    assert number is not None
    assert Fraction(number) == Fraction(value)
    assert scaled(number, 1.0).hex() == value.hex()


@given(st.decimals(allow_nan=False, allow_infinity=False, min_value=-1e9, max_value=1e9, places=6))
def test_a_scaled_number_is_rounded_once(number: Decimal) -> None:
    for scale in ("1e-3", "0.1", "-0.3", "1e6"):
        product = Fraction(number) * Fraction(Decimal(scale))
        assert scaled(number, float(scale)) == float(product)
        for offset in ("273.15", "-0.012"):
            assert scaled(number, float(scale), float(offset)) == float(product + Fraction(Decimal(offset)))


def test_millimetres_become_the_metres_one_would_write() -> None:
    assert 64.1 * 1e-3 != 0.0641
    assert scaled(Decimal("64.1"), 1e-3) == 0.0641


@pytest.mark.parametrize("nothing", [None, float("nan"), Decimal("NaN")])
def test_nothing(nothing: object) -> None:
    assert exact(nothing) is None


@pytest.mark.parametrize("value", [True, "1", b"1", float("inf"), Decimal("-Infinity"), [1.0], {"x": 1}])
def test_no_finite_number(value: object) -> None:
    with pytest.raises(ValueError, match=re.escape(f"expected a finite number, got {shown(value)}")):
        exact(value)


def test_too_large() -> None:
    with pytest.raises(
        ValueError, match=re.escape("expected a number that fits a float64, got 1.000e+308 (times 100.0)")
    ):
        scaled(Decimal("1e308"), 100.0)


@pytest.mark.parametrize("scale", [0.0, float("nan"), float("inf")])
def test_scales(scale: float) -> None:
    with pytest.raises(InputError, match=f"'x': expected a scale other than zero, got {scale}"):
        check_scale("x", scale)


def test_messages_show_numbers_plainly_and_little_of_the_rest() -> None:
    assert [plain(Decimal(text)) for text in ("1E+3", "25.600", "0.0", "-1E-9")] == [
        "1000",
        "25.6",
        "0",
        "-0.000000001",
    ]
    assert shown(Decimal("0.10")) == "0.10"
    assert shown("x" * 100) == "'" + "x" * 78 + "…"
