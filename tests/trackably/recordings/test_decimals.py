"""A number is rounded once, when it becomes a float64, and only a number is taken for one."""

import re
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.recordings.clocks import exact, scale_once

NO_NUMBERS = ["", "-", "1 000", "1_000", "-Infinity", "nan", "0x10", "1e", "1.2.3", "٣", "1e99999"]


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("text", NO_NUMBERS)
def test_no_numbers(text, mark):
    with pytest.raises(ValueError, match=re.escape(f"expected a finite number, got {text!r}") + "$"):
        exact(text, mark)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_exact_is_exact(value):
    number = exact(value)
    assert Fraction(number) == Fraction(value)
    assert scale_once(number, 1.0).hex() == value.hex()


@given(st.decimals(allow_nan=False, allow_infinity=False, min_value=-1e9, max_value=1e9, places=6))
def test_a_scaled_number_is_rounded_once(number):
    for scale in ("1e-3", "0.1", "-0.3", "1e6"):
        product = Fraction(number) * Fraction(Decimal(scale))
        assert scale_once(number, float(scale)) == float(product)
        for offset in ("273.15", "-0.012"):
            assert scale_once(number, float(scale), float(offset)) == float(product + Fraction(Decimal(offset)))
