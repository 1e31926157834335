"""One motion, written in every encoding, is read as the same signals."""

import json

import pytest
from mcap.writer import CompressionType

from tests.trackably.recordings.mcap_files.writers import START, STATES, TOPIC, WRITERS, write_plain
from trackably.errors import InputError
from trackably.recordings import Finding
from trackably.recordings.mcap_file import LOG_TIME, PUBLISH_TIME, Field, Stamp, read_mcap

HOW = {
    "stamp": (Stamp("stamp"), CompressionType.ZSTD),
    "log_time": (LOG_TIME, CompressionType.LZ4),
    "publish_time": (PUBLISH_TIME, CompressionType.NONE),
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "some.mcap"


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
@pytest.mark.parametrize("of", HOW)
def test_every_encoding_compression_and_time(path, write, of):
    time, compression = HOW[of]
    write(path, compression)
    recording = read_mcap(
        path,
        {
            "angle": Field(TOPIC, "joints[1].angle", time=time, offset=1),
            "y": Field(TOPIC, "position.y", time=time),
            "effort": Field(TOPIC, "effort", scale=-2, time=time),
        },
    )
    assert recording.origin == getattr(STATES[0], of)
    expected = {
        "angle": [(s, s.angles[1] + 1) for s in STATES],
        "y": [(s, 0.0) for s in STATES],
        "effort": [(s, -2 * s.effort) for s in STATES if s.effort is not None],
    }
    assert list(recording.signals) == [*expected]
    for name, signal in recording.signals.items():
        found = zip(signal.times.tolist(), signal.values.tolist(), strict=True)
        assert [*found] == [((getattr(s, of) - recording.origin) / 10**9, value) for s, value in expected[name]]
    (cleaning,) = recording.cleanings
    assert (cleaning.source, cleaning.rows) == (f"{path}, {TOPIC}", len(STATES))
    assert cleaning.findings == (Finding("no value of effort", 1, "message 4"),)


def read(path, field, time=LOG_TIME, **options):
    return read_mcap(path, {"x": Field(TOPIC, field, time=time)}, **options)


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


def test_signals_with_stamps_of_their_own_have_one_origin(path):
    now = START // 10**9
    written(path, *({"x": 1, "y": {"z": 7}, "y.z": 8, "t": now + 1 + k, "s": now + 3 * k} for k in range(2)))
    stamps = {"x": Stamp("t", "epoch s"), "y.z": Stamp("s", "epoch s")}
    recording = read_mcap(path, {name: Field(TOPIC, name, time=stamp) for name, stamp in stamps.items()})
    assert recording.origin == now * 10**9
    assert {name: of.times.tolist() for name, of in recording.signals.items()} == {"x": [1.0, 2.0], "y.z": [0.0, 3.0]}
    assert recording["y.z"].values.tolist() == [8.0, 8.0]


def test_stamps_in_json_keep_every_digit_and_count_from_the_origin_that_is_given(path):
    write_plain(path, [f'{{"t": 1700000000.00000000{k}, "x": 1}}'.encode() for k in (1, 2)])
    recording = read(path, "x", Stamp("t", "epoch s"), origin=START - 1)
    assert (recording.origin, recording["x"].times.tolist()) == (START - 1, [1e-9, 2e-9])


JOINTS = [{"elbow": 0.1, "wrist": 7}, {"wrist": 7, "elbow": 0.2}, {"gripper": 9}, {"elbow": 0.3}]
LISTS = {
    "a name in each entry, as in /tf": (
        [{"transforms": [{"child_frame_id": name, "x": x} for name, x in of.items()]} for of in JOINTS],
        "transforms[child_frame_id=elbow].x",
        "transforms[0].x",
    ),
    "a list of names beside, as in /joint_states": (
        [{"name": [*of], "position": [*of.values()]} for of in JOINTS],
        "position[name=elbow]",
        "position[0]",
    ),
}


@pytest.mark.parametrize("name", LISTS)
def test_an_entry_of_a_list_is_taken_by_its_name_and_a_number_that_means_another_one_later_is_refused(path, name):
    messages, by_name, by_number = LISTS[name]
    assert read(written(path, *messages), by_name)["x"].values.tolist() == [0.1, 0.2, 0.3]
    with pytest.raises(
        InputError, match=r"message 2, .* is of \[.*=wrist\] here, and was of \[.*=elbow\] before; write"
    ):
        read(path, by_number)
    with pytest.raises(
        InputError, match=r"expected a finite number, got \[.*; a path leads to one number: position\[0\]"
    ):
        read(path, by_name.partition("[")[0])
