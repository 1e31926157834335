"""Logs are read as they were written, hold what viewers can plot, and refuse what breaks their rules."""

import importlib
import json
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from pipeline.storage.logs import Documents, Log, Series, read_log, write_log
from tests.pipeline.storage.logs import LOG, NAN, same


def validator() -> Any:
    """Load jsonschema where it is used: it builds parsers for seconds, in each process that collects the tests."""
    return importlib.import_module("jsonschema").Draft202012Validator


def test_round_trip_and_equal_logs_are_equal_files(path: Path, data: bytes) -> None:
    assert same(read_log(path), LOG)
    write_log(path, replace(LOG))
    assert path.read_bytes() == data


finite = st.floats(allow_nan=False, allow_infinity=False)
rows = st.lists(st.tuples(st.floats(0, 9e9), finite | st.just(NAN)), max_size=8)


@given(st.lists(rows, max_size=3))
def test_round_trip_of_any_numbers(
    tmp_path_factory: pytest.TempPathFactory, columns: list[list[tuple[float, float]]]
) -> None:
    series = []
    for i, column in enumerate(columns):
        times, values = np.array(sorted(t for t, _ in column)), np.array([x for _, x in column])
        series.append(Series(f"/topic{i}", times, {"x": np.where(np.isnan(values), np.nan, values)}))
    log = Log(tuple(series), {}, {"a": b"0"})
    path = tmp_path_factory.mktemp("log") / "any.mcap"
    write_log(path, log)
    assert same(read_log(path), log)


def test_viewers_find_valid_messages_in_the_order_of_time(path: Path, data: bytes) -> None:
    reader = make_reader(BytesIO(data), validate_crcs=True)
    found: dict[str, int] = {}
    last = 0
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        content = json.loads(message.data)
        validator()(json.loads(schema.data)).validate(content)
        assert all(isinstance(value, float) for value in content.values())
        assert message.log_time == message.publish_time == round(content["t"] * 1e9) >= last
        assert message.sequence == found.get(channel.topic, 0)
        found[channel.topic] = found.get(channel.topic, 0) + 1
        last = message.log_time
    assert found == {series.topic: len(series.times) for series in LOG.series if len(series.times)}
    assert {a.name: a.data for a in reader.iter_attachments()} == LOG.attachments
    assert {a.media_type for a in reader.iter_attachments()} == {"application/json"}
    assert {m.name: m.metadata for m in reader.iter_metadata()} == {"trackably": {"format": "1"}, **LOG.metadata}


T = np.array([0.0, 1.0])


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: Series("/a", T, {"x": np.array([0, np.inf])}), r"/a: x\[1\] must be finite or NaN, got inf"),
        (lambda: Series("/a", T, {"x": np.array([-np.inf, 0])}), r"/a: x\[0\] must be finite"),
        (lambda: Series("/a", T, {"x": T[:1]}), r"/a: x must be .* got shape \(1,\) beside \(2,\)"),
        (lambda: Series("/a", T[:, None], {}), "/a: t must be one-dimensional"),
        (lambda: Series("/a", T[::-1], {}), r"t\[1\] lies before t\[0\]"),
        (lambda: Series("/a", T - 1, {}), r"t\[0\] must be in \[0, "),
        (lambda: Series("/a", T * 1e10, {}), r"t\[1\] must be in"),
        (lambda: Series("/a", np.array([0, NAN]), {}), r"t\[1\] must be in"),
        (lambda: Series("/a", T, {"t": T}), "'t'"),
        (lambda: Series("/a", T, {"a b": T}), "'a b'"),
        (lambda: Series("/a", T, {"a.": T}), "'a.'"),
        (lambda: Series("/a", T, {"x": T}, {"y": "m"}), "units of no field: y"),
        (lambda: Series("a", T, {}), "topic"),
        (lambda: Series("/", T, {}), "topic"),
        (lambda: Documents("a", "foxglove.Log", {}, ()), "documents"),
        (lambda: Documents("/a", "Log", {}, ()), "schema"),
        (lambda: Documents("/a", "foxglove.Log", {}, ((2, {}), (1, {}))), "times"),
        (lambda: Log((Series("/a", T, {}),) * 2, {}, {"a": b"0"}), "several of /a"),
        (lambda: Log((), {"trackably": {}}, {"a": b"0"}), "written by the log itself"),
        (lambda: Log((), {}, {}), "at least one attachment"),
        (lambda: Log((), {}, {"a": b"NaN"}), "attachment 'a' must be JSON: NaN"),
    ],
)
def test_what_breaks_a_rule_is_named(make: Callable[[], object], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        make()
