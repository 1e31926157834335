"""Damaged files, unknown encodings, topics and fields are refused in one sentence: every other outcome is a defect."""

import numpy as np
import pytest
from mcap.writer import CompressionType

from tests.trackably.recordings.mcap_files.writers import TOPIC, WRITERS, refusal, write_plain
from trackably.errors import InputError
from trackably.recordings.mcap_file import Field, Stamp, read_mcap


@pytest.fixture
def path(tmp_path):
    return tmp_path / "some.mcap"


NO_MCAP = {
    b"": ": no MCAP file, or damaged: ",
    b"\xff\xfe\0": ": no MCAP file, or damaged: ",
    b"\x89MCAP0\r\n": ": no MCAP file, or damaged: ",
    b"SQLite format 3\0": ": this is a database, as ROS 2 bags are (.db3): `mcap convert`",
}


@pytest.mark.parametrize("data", NO_MCAP)
def test_no_mcap(path, data):
    path.write_bytes(data)
    assert refusal(path).startswith(NO_MCAP[data])


UNDECODABLE = {
    "no JSON": (b"{x: 1}", ("json", None), b""),
    "deep JSON": (b"[" * 100000, ("json", None), b""),
    "large exponent": (b'{"x": 1e99999999999999999999}', ("json", None), b""),
    "endless array": (b"\0\1\0\0\xff\xff\xff\xff", ("cdr", "ros2msg"), b"float64[] x"),
}


@pytest.mark.parametrize("name", UNDECODABLE)
def test_undecodable(path, name):
    data, encodings, schema = UNDECODABLE[name]
    write_plain(path, [data], encodings=encodings, schema=schema)
    said = refusal(path)
    assert said.startswith(f", {TOPIC}, message 1: it cannot be decoded (")
    assert "mcap recover" not in said


@pytest.mark.parametrize(("name", "compression"), [("json", CompressionType.NONE), ("ros2", CompressionType.ZSTD)])
def test_truncated_anywhere(path, name, compression):
    WRITERS[name](path, compression)
    data = path.read_bytes()
    for end in [*range(0, len(data), 61), len(data) - 1]:
        path.write_bytes(data[:end])
        assert refusal(path, "position.x").startswith(": no MCAP file, or damaged: ")
    assert "it ends too early (if a recorder was cut off, 'mcap recover'" in refusal(path, "position.x")


@pytest.mark.parametrize("name", WRITERS)
def test_flipped_bits(path, name):
    """A flipped bit may go unseen only in what is not read."""
    WRITERS[name](path, CompressionType.NONE)
    data, honest = path.read_bytes(), values_of(path)
    rng, refused = np.random.default_rng(3), []
    for at in rng.integers(8, len(data), 40).tolist():
        damaged = bytearray(data)
        damaged[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            assert values_of(path) == honest
        except InputError as error:
            refused.append(str(error))
    assert 3 < len(refused) < 37
    assert all(said.startswith(str(path)) for said in refused)


def test_unknown_topic(path):
    WRITERS["protobuf"](path, CompressionType.ZSTD)
    assert (
        refusal(path, topic="/robot")
        == ": there is no topic '/robot'; there are /robot/state (protobuf robot.State, 6 messages)"
    )


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("field", ["position.z", "joints[2].angle", "joints.angle", "joints[x]", "position[0]", ".."])
def test_unknown_field(path, name, field):
    WRITERS[name](path, CompressionType.ZSTD)
    for said in (refusal(path, field), refusal(path, "position.x", Stamp(field))):
        assert said.startswith(f", {TOPIC}: there is no field {field!r}; the first message has stamp.")


def values_of(path):
    return read_mcap(path, {"x": Field(TOPIC, "position.x", time=Stamp("stamp"))})["x"].values.tolist()
