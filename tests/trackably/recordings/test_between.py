"""Rows outside of the times that are asked for are not judged: what is inside reads as if there were no others."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from trackably.errors import InputError
from trackably.recordings import Column, read_csv

INSIDE = "".join(f"{t},{t * t},0.1\n" for t in (10, 11, 12))
WRONG = {
    "repeated": "20,1,0.1\n20,2,0.1\n",
    "out of order": "30,1,0.1\n20,2,0.1\n",
    "no number": "20,lost,0.1\n",
    "no noise": "20,1,0\n",
    "before": "0,1,0\n0,lost,0.1\n",
}


@pytest.mark.parametrize("wrong", WRONG.values(), ids=WRONG)
@pytest.mark.parametrize("is_first", [False, True])
def test_a_wrong_row_outside_does_no_harm(wrong, is_first, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(f"t,x,s\n{wrong}{INSIDE}" if is_first else f"t,x,s\n{INSIDE}{wrong}", encoding="utf-8")
    signals = {"x": Column("x", noise_std="s")}
    with pytest.raises(InputError, match=r"a\.csv, line \d"):
        read_csv(path, "t", "s", signals)
    found = read_csv(path, "t", "s", signals, between=(10.0, 12.0))["x"]
    assert found.times.tolist() == [10.0, 11.0, 12.0]
    assert found.values.tolist() == [100.0, 121.0, 144.0]


@given(st.lists(st.integers(0, 300), min_size=3, max_size=40, unique=True).map(sorted), st.data())
def test_it_is_a_selection_of_a_recording_that_is_right(tmp_path_factory, stamps, data):
    """Counted from the first sample too, which may be outside, and have no value."""
    start = data.draw(st.sampled_from(stamps[:-1])) - stamps[0]
    end = data.draw(st.sampled_from([s for s in stamps if s - stamps[0] > start])) - stamps[0]
    path = tmp_path_factory.mktemp("between") / "a.csv"
    path.write_text("t,x\n-1,\n" + "".join(f"{t},{t % 7}\n" for t in stamps))
    whole = read_csv(path, "t", "s", {"x": "x"}, origin="first").select(start, end)
    part = read_csv(path, "t", "s", {"x": "x"}, origin="first", between=(start, end))
    assert part.origin == whole.origin == stamps[0] * 10**9
    np.testing.assert_array_equal(part["x"].times, whole["x"].times)
    np.testing.assert_array_equal(part["x"].values, whole["x"].values)
