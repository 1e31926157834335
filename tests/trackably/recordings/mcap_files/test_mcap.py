"""One motion, written in every encoding, is read as the same signals."""

import json

import pytest
from hypothesis import strategies as st
from mcap.writer import CompressionType

from tests.trackably.recordings.mcap_files.writers import START, STATES, TOPIC, WRITERS, write_plain
from trackably.recordings import Finding
from trackably.recordings.mcap_file import LOG_TIME, PUBLISH_TIME, Field, Stamp, read_mcap

FLOATS = st.floats(allow_nan=False, allow_infinity=False)
STAMP = Stamp("stamp")
each_encoding = pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "some.mcap"


def read(path, field, time=LOG_TIME, **options):
    return read_mcap(path, {"x": Field(TOPIC, field, time=time)}, **options)


@each_encoding
@pytest.mark.parametrize("compression", CompressionType)
def test_every_encoding_and_compression(path, write, compression):
    write(path, STATES, compression)
    recording = read_mcap(
        path,
        {
            "angle": Field(TOPIC, "joints[1].angle", time=STAMP, offset=1),
            "y": Field(TOPIC, "position.y", time=STAMP),
            "effort": Field(TOPIC, "effort", scale=-2, time=STAMP, noise_std="std"),
        },
    )
    assert recording.origin == START
    expected = {
        "angle": [(s.stamp, s.angles[1] + 1, 1.0) for s in STATES],
        "y": [(s.stamp, 0.0, 1.0) for s in STATES],
        "effort": [(s.stamp, -2 * s.effort, 2 * s.std) for s in STATES if s.effort is not None],
    }
    assert list(recording.signals) == [*expected]
    for name, of in recording.signals.items():
        found = zip(of.times.tolist(), of.values.tolist(), of.relative_noise.tolist(), strict=True)
        assert [*found] == [((stamp - START) / 10**9, *values) for stamp, *values in expected[name]]
    (cleaning,) = recording.cleanings
    assert (cleaning.source, cleaning.rows) == (f"{path}, {TOPIC}", len(STATES))
    assert cleaning.findings == (Finding("no value of effort", 1, "message 4"),)


@each_encoding
@pytest.mark.parametrize(
    ("time", "of"), [(LOG_TIME, "log_time"), (PUBLISH_TIME, "publish_time"), (STAMP, "stamp")], ids=str
)
def test_every_time(path, write, time, of):
    write(path, STATES, CompressionType.ZSTD)
    stamps = [getattr(s, of) for s in STATES]
    recording = read(path, "position.x", time)
    assert recording.origin == stamps[0]
    assert recording["x"].times.tolist() == [(stamp - stamps[0]) / 10**9 for stamp in stamps]
    stated = read(path, "position.x", time, origin=START - 1)
    assert stated.origin == START - 1
    assert stated["x"].times.tolist() == [(stamp - START + 1) / 10**9 for stamp in stamps]


def written(path, *messages):
    write_plain(path, [json.dumps(message).encode() for message in messages])
    return path


STAMPS = {
    "s": (Stamp("t", "s"), [0.1, 0.30000000000000004, 7], 0, [0.1, 0.30000000000000004, 7.0]),
    "ROS 1": (Stamp("t"), [{"secs": k, "nsecs": 5} for k in (1, 2, 4)], 1_000000005, [0.0, 1.0, 3.0]),
    "deep": (Stamp("t[0].at"), [[{"at": {"sec": k, "nanosec": 5}}] for k in (1, 2, 4)], 1_000000005, [0.0, 1.0, 3.0]),
}


@pytest.mark.parametrize("name", STAMPS)
def test_stamps(path, name):
    time, stamps, origin, times = STAMPS[name]
    recording = read(written(path, *({"t": stamp, "x": k} for k, stamp in enumerate(stamps))), "x", time)
    assert recording.origin == origin
    assert recording["x"].times.tolist() == times


def test_stamps_in_json_keep_every_digit(path):
    write_plain(path, [f'{{"t": 1700000000.00000000{k}, "x": 1}}'.encode() for k in (1, 2)])
    recording = read(path, "x", Stamp("t", "epoch s"))
    assert (recording.origin, recording["x"].times.tolist()) == (START, [0.0, 1e-9])
