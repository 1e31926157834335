"""Each repair does what it says, to those rows alone, and counts them; what no repair was chosen for is refused."""

from collections.abc import Sequence
from decimal import Decimal
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackable.errors import InputError
from trackable.recordings import (
    REPAIRS,
    Finding,
    Recording,
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
from trackable.recordings.order import out_of_order
from trackable.recordings.origin import Origin
from trackable.recordings.repairs import chosen_repairs
from trackable.recordings.settle import recorded

NAN = float("nan")


def rows(stamps: Sequence[str | None], noise: Sequence[float] | None = None, **values: Sequence[float]) -> Rows:
    """A table; its rows stand on lines 2, 3, …"""
    return Rows(
        "a.csv",
        [f"line {row + 2}" for row in range(len(stamps))],
        [None if stamp is None else Decimal(stamp) for stamp in stamps],
        {name: np.array(column, dtype=float) for name, column in values.items()},
        {} if noise is None else {"x": np.array(noise, dtype=float)},
    )


def record(table: Rows, *repairs: Repair, absolute: bool = False, origin: Origin = None) -> Recording:
    return recorded([table], absolute, repairs, origin)


def content(recording: Recording) -> dict[str, list[tuple[float, float]]]:
    """Each signal as (time, value)."""
    return {name: list(zip(s.times.tolist(), s.values.tolist(), strict=True)) for name, s in recording.signals.items()}


def findings(recording: Recording) -> tuple[Finding, ...]:
    (cleaning,) = recording.cleanings
    return cleaning.findings


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


REPEATED = rows(["0", "1", "1", "1", "2"], x=[9.0, 1.0, 2.0, 6.0, 8.0], y=[9.0, NAN, 1.0, NAN, 8.0])


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


REFUSALS: dict[str, tuple[Rows, tuple[Repair, ...], str]] = {
    "no time": (
        rows(["0", None], x=[1, 2]),
        (),
        "a.csv, line 3: the row has no time (drop_rows_without_time leaves such rows out)",
    ),
    "no time to sort by": (
        rows(["0", None], x=[1, 2]),
        (sort_rows,),
        "a.csv, line 3: the row has no time (drop_rows_without_time leaves such rows out)",
    ),
    "out of order": (
        rows(["0", "12.70", "0.0256", "0.03", "12.8"], x=range(5)),
        (),
        "a.csv, line 4: times must not decrease, got 0.0256 s after 12.7 s; 1 row is out of order "
        "(sort_rows sorts them, drop_rows_out_of_order leaves them out)",
    ),
    "repeated": (
        REPEATED,
        (),
        "a.csv, line 4: 'x' has a second value at 1 s, the first is in line 3; 2 rows are repeated "
        "(keep_first_of_repeated, keep_last_of_repeated or average_repeated makes one of them)",
    ),
    "nothing but gaps": (
        rows(["0", "1"], x=[1, 2], y=[NAN, NAN]),
        (),
        "a.csv: 'y' has no value in any of the 2 rows left",
    ),
    "nothing left": (rows(["0"], x=[0]), (drop_zero_rows,), "a.csv: 'x' has no value in any of the 0 rows left"),
    "noise of zero": (
        rows(["0", "1"], noise=[0.1, 0], x=[1, 2]),
        (),
        "a.csv, line 3: expected a positive standard deviation of 'x', got 0",
    ),
    "no noise": (
        rows(["0", "1"], noise=[0.1, NAN], x=[1, 2]),
        (),
        "a.csv, line 3: expected a positive standard deviation of 'x', got none",
    ),
    "noise of zero in a mean": (
        rows(["0", "0"], noise=[0.1, 0], x=[1, 2]),
        (average_repeated,),
        "a.csv, line 2: expected a positive standard deviation of 'x', got none",
    ),
    "closer than a float64 can tell": (
        rows(["1", "1.00000000000000000001"], x=[1, 2]),
        (),
        "a.csv, line 3: this time and that of line 2 are one and the same float64, 1 s after the origin 0 ns",
    ),
    "no float64": (
        rows(["0", "1e400"], x=[1, 2]),
        (),
        "a.csv, line 3: expected a time that fits a float64, got 1E+400 s",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_refused(name: str) -> None:
    table, repairs, message = REFUSALS[name]
    with pytest.raises(InputError) as caught:
        record(table, *repairs)
    assert str(caught.value) == message


def test_noise_matters_only_where_there_is_a_value() -> None:
    recording = record(rows(["0", "1"], noise=[0.1, NAN], x=[1, NAN]))
    assert recording["x"].noise_std is not None
    assert recording["x"].noise_std.tolist() == [0.1]


EPOCH = ["1700000000.000000001", "1700000000.100000001", "1700000000.300000002"]


def test_the_origin_is_the_first_sample_exactly() -> None:
    recording = record(rows(["0", *EPOCH], x=[NAN, 1, 2, 3]), absolute=True)
    assert recording.origin == 1700000000_000000001
    assert recording["x"].times.tolist() == [0.0, 0.1, 0.300000001]
    for time, stamp in zip(recording["x"].times.tolist(), EPOCH, strict=True):
        assert recording.origin + round(time * 1e9) == int(Decimal(stamp) * 10**9)


@pytest.mark.parametrize(("stamp", "origin"), [("-1.5", -1500000000), ("-0.0000000001", -1), ("0.0000000019", 1)])
def test_the_origin_is_rounded_down(stamp: str, origin: int) -> None:
    recording = record(rows([stamp], x=[1]), absolute=True)
    assert recording.origin == origin
    assert recording["x"].times[0] == float(Decimal(stamp) - Decimal(origin).scaleb(-9))


def test_a_stated_origin_is_kept() -> None:
    recording = record(rows(EPOCH, x=[1, 2, 3]), absolute=True, origin=1700000000_000000000)
    assert recording.origin == 1700000000_000000000
    assert recording["x"].times.tolist() == [1e-9, 0.100000001, 0.300000002]


@pytest.mark.parametrize("absolute", [True, False])
def test_the_first_sample_as_origin(absolute: bool) -> None:
    table = rows(["1", "184.2304", "184.3304"], x=[NAN, 1, 2], y=[NAN, NAN, 3])
    recording = record(table, absolute=absolute, origin="first")
    assert (recording.origin, recording.absolute) == (184_230_400_000, absolute)
    assert content(recording) == {"x": [(0.0, 1.0), (0.1, 2.0)], "y": [(0.1, 3.0)]}


def test_several_tables_have_one_origin() -> None:
    other = Rows("b", ["message 1"], [Decimal("1699999999")], {"y": np.array([7.0])})
    recording = recorded([rows(EPOCH, x=[1, 2, 3]), other], True, (), None)
    assert recording.origin == 1699999999_000000000
    assert recording["y"].times.tolist() == [0.0]
    assert recording["x"].times.tolist() == [1.000000001, 1.100000001, 1.300000002]
    assert [cleaning.source for cleaning in recording.cleanings] == ["a.csv", "b"]


def test_a_repair_of_ones_own() -> None:
    def halve(table: Rows) -> tuple[Rows, tuple[Finding, ...]]:
        return table.only(range(0, len(table), 2)), (Finding("halved", len(table) // 2, table.places[1]),)

    recording = record(rows(["0", "1", "2"], x=[1, 2, 3]), halve)
    assert content(recording) == {"x": [(0.0, 1.0), (2.0, 3.0)]}
    assert findings(recording) == (Finding("halved", 1, "line 3"),)
