"""Each repair changes the rows that it names and no others, and counts them."""

from collections.abc import Sequence
from decimal import Decimal
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trackably.recordings.tables import NAN, REPEATED, content, findings, record, rows
from trackably.errors import InputError
from trackably.recordings import (
    REPAIRS,
    Finding,
    Repair,
    Rows,
    average_repeated,
    drop_rows_out_of_order,
    drop_rows_without_time,
    drop_zero_rows,
    keep_first_of_repeated,
    keep_last_of_repeated,
    sort_rows,
)
from trackably.recordings.rows import chosen_repairs, out_of_order

DIRTY = rows(
    ["0", "2", "1", None, "2", "5", "0"],
    x=[1.0, 2.0, 3.0, 4.0, 5.0, NAN, 0.0],
    y=[-1.0, NAN, -3.0, -4.0, -5.0, -6.0, 0.0],
)


def test_chosen_repairs_are_done_and_reported() -> None:
    recording = record(DIRTY, drop_zero_rows, drop_rows_without_time, sort_rows, keep_first_of_repeated)
    assert content(recording) == {
        "x": [(0.0, 1.0), (1.0, 3.0), (2.0, 2.0)],
        "y": [(0.0, -1.0), (1.0, -3.0), (2.0, -5.0), (5.0, -6.0)],
    }
    assert recording.cleanings[0].rows == 7
    assert findings(recording) == (
        Finding("no value of x", 1, "line 7"),
        Finding("no value of y", 1, "line 3"),
        Finding("zero in every signal, dropped", 1, "line 8"),
        Finding("no time, dropped", 1, "line 5"),
        Finding("out of order, sorted", 1, "line 4"),
        Finding("time repeated, first kept", 1, "line 6"),
    )


def test_nothing_is_done_and_reported_where_nothing_is_wrong() -> None:
    clean = rows(["0", "0.5", "3"], x=[1, 2, 3])
    recording = record(clean, *REPAIRS.values())
    assert content(recording) == content(record(clean)) == {"x": [(0.0, 1.0), (0.5, 2.0), (3.0, 3.0)]}
    assert findings(recording) == ()


@pytest.mark.parametrize(
    ("repair", "kept", "word"),
    [
        (keep_first_of_repeated, 1.0, "first kept"),
        (keep_last_of_repeated, 6.0, "last kept"),
        (average_repeated, 3.0, "averaged"),
    ],
)
def test_repeats(repair: Repair, kept: float, word: str) -> None:
    recording = record(REPEATED, repair)
    assert content(recording) == {
        "x": [(0.0, 9.0), (1.0, kept), (2.0, 8.0)],
        "y": [(0.0, 9.0), (1.0, 1.0), (2.0, 8.0)],
    }
    assert findings(recording)[1:] == (Finding(f"time repeated, {word}", 2, "line 4"),)


@pytest.mark.parametrize(
    ("repair", "expected"),
    [(keep_first_of_repeated, 0.3), (keep_last_of_repeated, 0.4), (average_repeated, 0.25)],
)
def test_noise_of_repeats(repair: Repair, expected: float) -> None:
    recording = record(rows(["0", "1", "1"], noise=[0.1, 0.3, 0.4], x=[0, 1, 2]), repair)
    noise_std = recording["x"].noise_std
    assert noise_std is not None
    np.testing.assert_allclose(noise_std, [0.1, expected], rtol=1e-15)


def test_dropping_out_of_order_spares_what_follows_a_stamp_of_the_future() -> None:
    recording = record(rows(["0", "1", "99", "2", "3"], x=range(5)), drop_rows_out_of_order)
    assert content(recording) == {"x": [(0.0, 0.0), (1.0, 1.0), (2.0, 3.0), (3.0, 4.0)]}
    assert findings(recording) == (Finding("out of order, dropped", 1, "line 4"),)


@given(st.lists(st.integers(0, 6), max_size=9))
def test_the_fewest_rows_are_out_of_order(numbers: list[int]) -> None:
    wrong = out_of_order([Decimal(number) for number in numbers])

    def ordered(without: Sequence[int]) -> bool:
        kept = [number for row, number in enumerate(numbers) if row not in without]
        return kept == sorted(kept)

    assert ordered(wrong)
    assert not any(ordered(fewer) for fewer in combinations(range(len(numbers)), max(len(wrong) - 1, 0))) or not wrong


@pytest.mark.parametrize(("numbers", "wrong"), [([], []), ([1, 3, 2, 4], [2]), ([5, 1], [1]), ([1, 2, 3, 0], [3])])
def test_of_two_swapped_rows_the_later_one_is_out_of_order(numbers: list[int], wrong: list[int]) -> None:
    assert out_of_order([Decimal(number) for number in numbers]) == wrong


def test_by_name() -> None:
    assert all(repair.__name__ == name for name, repair in REPAIRS.items())
    assert REPAIRS["sort_rows"] is sort_rows


def test_chosen_by_name() -> None:
    def own(table: Rows) -> tuple[Rows, tuple[Finding, ...]]:
        return table, ()

    assert chosen_repairs(()) == []
    assert chosen_repairs(list(REPAIRS)) == list(REPAIRS.values())
    assert chosen_repairs(("sort_rows", own, drop_zero_rows)) == [sort_rows, own, drop_zero_rows]


LISTED = (
    "drop_rows_without_time, drop_zero_rows, drop_rows_out_of_order, sort_rows, keep_first_of_repeated, "
    "keep_last_of_repeated, average_repeated"
)


@pytest.mark.parametrize(
    ("repairs", "message"),
    [
        (["sort_rows", "sort rows"], f"there is no repair 'sort rows'; there are {LISTED}"),
        ([None], f"there is no repair None; there are {LISTED}"),
        ("sort_rows", "repairs: expected a list of them, in their order, got sort_rows by itself"),
        (sort_rows, "repairs: expected a list of them, in their order, got sort_rows by itself"),
    ],
)
def test_nothing_chosen(repairs: Any, message: str) -> None:
    with pytest.raises(InputError) as caught:
        chosen_repairs(repairs)
    assert str(caught.value) == message


def test_zeros_are_kept_unless_dropping_them_is_chosen() -> None:
    table = rows(["0", "1"], x=[0, 1], y=[0, 0])
    assert content(record(table))["x"] == [(0.0, 0.0), (1.0, 1.0)]
    assert findings(record(table)) == (Finding("zero in every signal, kept", 1, "line 2"),)
    assert findings(record(rows(["0", "1"], x=[0, 1]))) == ()


def test_a_repair_of_ones_own() -> None:
    def halve(table: Rows) -> tuple[Rows, tuple[Finding, ...]]:
        return table.only(range(0, len(table), 2)), (Finding("halved", len(table) // 2, table.places[1]),)

    recording = record(rows(["0", "1", "2"], x=[1, 2, 3]), halve)
    assert content(recording) == {"x": [(0.0, 1.0), (2.0, 3.0)]}
    assert findings(recording) == (Finding("halved", 1, "line 3"),)
