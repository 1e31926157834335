"""Logs are read as they were written, hold what viewers can plot, and refuse what breaks their rules."""

import json
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from pipeline.storage.logs import Log, Series, encode, read_log, write_log
from tests.pipeline.storage.logs import LOG
from tests.trackably.gp.instances import over


def test_what_is_read_is_to_the_bit_what_was_written_and_equal_logs_are_equal_files(path: Path, data: bytes) -> None:
    with np.printoptions(floatmode="unique"):  # which is exact, and tells -0 from 0
        assert repr(read_log(path)) == repr(LOG)
    write_log(path, replace(LOG))
    assert path.read_bytes() == data


def test_viewers_find_valid_messages_in_the_order_of_time(path: Path, data: bytes) -> None:
    reader = make_reader(BytesIO(data), validate_crcs=True)
    found: dict[str, int] = {}
    last = 0
    for schema, channel, message in reader.iter_messages():
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        content, described = json.loads(message.data), json.loads(schema.data)
        assert described["type"] == "object"
        assert all(described["properties"][name]["type"] == "number" for name in content)
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
UNREADABLE = {
    "a field of another length": (
        lambda: encode(Log((Series("/a", T, {"x": T[:1]}),), {}, {"a": b"0"})),
        "shorter",
    ),
    "infinite values": (
        lambda: encode(Log((Series("/a", T, {"x": np.array([0, np.inf])}),), {}, {"a": b"0"})),
        "not JSON",
    ),
}


@over(UNREADABLE, "make", "complaint")
def test_what_no_viewer_could_read_is_not_written(make, complaint):
    with pytest.raises(ValueError, match=complaint):
        make()
