"""A log is one file or one LogError: every other outcome of reading is a defect."""

import json
import re
import warnings
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from pipeline.storage.logs import Log, LogError, Series, read_log, write_log

NAN = float("nan")
TIMES = np.array([0.0, 0.1 + 0.2, 0.3 + 1e-16, 7.0, 1e5 / 3])
LOG = Log(
    series=(
        Series(
            "/reference/sound",
            TIMES,
            {"value": np.array([0.1, NAN, -0.0, 5e-324, 1.7e308]), "left.rate": np.array([NAN] * 4 + [1.0])},
            {"value": "m", "left.rate": "m/s"},
        ),
        Series("/other", TIMES[:3] / 2, {"never": np.full(3, NAN)}),
        Series("/without_rows", np.array([]), {"value": np.array([])}),
        Series("/without_fields", np.array([1.0]), {}),
    ),
    metadata={"experiment": {"name": "ein Beispiel, schön", "seed": "1"}, "empty": {}},
    attachments={"b.json": b'{"x": 0.1}\n', "a.json": b"[]"},
)


def same(a: Log, b: Log) -> bool:
    """Equality to the bit, NaN included, the order of everything too."""

    def plain(log: Log) -> object:
        return (
            [
                (s.topic, s.times.tobytes(), [(n, v.tobytes()) for n, v in s.fields.items()], list(s.units.items()))
                for s in log.series
            ],
            [(name, list(record.items())) for name, record in log.metadata.items()],
            list(log.attachments.items()),
        )

    return plain(a) == plain(b)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "some.mcap"


@pytest.fixture
def data(path: Path) -> bytes:
    write_log(path, LOG)
    return path.read_bytes()


def refusal(path: Path, data: bytes) -> str:
    """The sentence with which these bytes are refused."""
    path.write_bytes(data)
    with pytest.raises(LogError) as caught:
        read_log(path)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value).removeprefix(f"{path}: ")


def test_round_trip(path: Path, data: bytes) -> None:
    assert same(read_log(path), LOG)


def test_equal_logs_are_equal_files(tmp_path: Path, data: bytes) -> None:
    write_log(tmp_path / "again.mcap", replace(LOG))
    assert (tmp_path / "again.mcap").read_bytes() == data


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


def test_more_than_one_chunk(path: Path) -> None:
    n = 25_000
    series = Series("/long", np.arange(n) / 10, {"x": np.sqrt(np.arange(n)), "y": np.cbrt(np.arange(n))})
    log = Log((series,), {}, {"a": b"0"})
    write_log(path, log)
    assert path.stat().st_size > 2**20
    assert same(read_log(path), log)


def test_viewers_find_valid_messages_in_the_order_of_time(path: Path, data: bytes) -> None:
    reader = make_reader(BytesIO(data), validate_crcs=True)
    found: dict[str, int] = {}
    last = 0
    for schema, channel, message in reader.iter_messages():
        assert schema is not None
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        content = json.loads(message.data)
        jsonschema.Draft202012Validator(json.loads(schema.data)).validate(content)
        assert all(isinstance(value, float) for value in content.values())
        assert message.log_time == message.publish_time == round(content["t"] * 1e9) >= last
        assert message.sequence == found.get(channel.topic, 0)
        found[channel.topic] = found.get(channel.topic, 0) + 1
        last = message.log_time
    assert found == {series.topic: len(series.times) for series in LOG.series if len(series.times)}
    assert {a.name: a.data for a in reader.iter_attachments()} == LOG.attachments
    assert {a.media_type for a in reader.iter_attachments()} == {"application/json"}
    assert {m.name: m.metadata for m in reader.iter_metadata()} == {"trackable": {"format": "1"}, **LOG.metadata}


def test_schemas_are_flat_and_tell_units(data: bytes) -> None:
    summary = make_reader(BytesIO(data)).get_summary()
    assert summary is not None
    for schema in summary.schemas.values():
        content = json.loads(schema.data)
        jsonschema.Draft202012Validator.check_schema(content)
        assert content["type"] == "object"
        assert {about["type"] for about in content["properties"].values()} == {"number"}
    described = json.loads(summary.schemas[1].data)["properties"]
    assert {name: about["description"] for name, about in described.items()} == {
        "t": "s",
        "value": "m",
        "left.rate": "m/s",
    }


def test_a_file_that_is_missing_is_no_damage(path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_log(path)


def test_every_cut_is_found(path: Path, data: bytes) -> None:
    for length in [*range(0, len(data), 13), *range(len(data) - 40, len(data))]:
        refusal(path, data[:length])


def test_every_flipped_bit_is_found(path: Path, data: bytes) -> None:
    # A stride without a common factor with 8 meets each of the bits of a byte, and every kind of record.
    for bit in range(0, 8 * len(data), 19):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        refusal(path, bytes(damaged))


def test_what_no_checksum_covers_is_found(path: Path, data: bytes) -> None:
    # The library does not look at the checksum of the closing summary, nor at what follows the end.
    assert "damaged" in refusal(path, data + b"\0")
    summary_checksum = len(data) - 8 - 4
    assert f"byte {summary_checksum} " in refusal(path, data[:summary_checksum] + b"\0\0\0\0" + data[-8:])


def test_swapped_bytes_are_found(path: Path, data: bytes) -> None:
    generator = np.random.default_rng(1)
    for _ in range(300):
        damaged = bytearray(data)
        for i in generator.integers(len(data), size=3):
            damaged[i] ^= generator.integers(1, 256)
        refusal(path, bytes(damaged))


SCHEMA = b'{"type": "object", "properties": {"t": {"type": "number"}, "x": {"type": "number"}}}'


def foreign(
    *,
    library: str = "trackable",
    version: str = "1",
    compression: CompressionType = CompressionType.NONE,
    encoding: str = "json",
    schema_encoding: str = "jsonschema",
    schema: bytes = SCHEMA,
    message: bytes = b'{"t":0.0}',
) -> bytes:
    """A sound MCAP file with right checksums, and one message that another program may have written."""
    buffer = BytesIO()
    writer = Writer(buffer, compression=compression, enable_data_crcs=True)
    writer.start(library=library)
    writer.add_metadata("trackable", {"format": version})
    writer.add_attachment(0, 0, "a", "application/json", b"0")
    schema_id = writer.register_schema("x", schema_encoding, schema) if schema_encoding else 0
    writer.add_message(writer.register_channel("/x", encoding, schema_id), 0, message, 0)
    writer.finish()
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (foreign(), "byte .* is not what its content gives"),
        (foreign(library="other"), "calls itself 'other'"),
        (foreign(version="2"), "format is '2'"),
        (foreign(compression=CompressionType.ZSTD), "compressed \\('zstd'\\)"),
        (foreign(compression=CompressionType.LZ4), "compressed \\('lz4'\\)"),
        (foreign(encoding="cbor"), "/x: encodings .* got cbor and jsonschema"),
        (foreign(schema_encoding="protobuf"), "got json and protobuf"),
        (foreign(schema_encoding=""), "no schema 0"),
        (foreign(schema=b"[]"), "describes no object"),
        (foreign(schema=b'{"properties": {"x": {}}}'), "describes no object with a time"),
        (foreign(message=b'{"t":0.0,"y":1.0}'), r"/x\[0\]: the schema knows no field y"),
        (foreign(message=b'{"x":1.0}'), "with a time 't'"),
        (foreign(message=b"[0.0]"), "must be an object"),
        (foreign(message=b'{"t":0.0,"x":"1"}'), "x must be a number .* got '1'"),
        (foreign(message=b'{"t":0.0,"x":true}'), "x must be a number .* got True"),
        (foreign(message=b'{"t":0.0,"x":NaN}'), "NaN"),
        (foreign(message=b'{"t":0.0,"x":1e999}'), r"x\[0\] must be finite"),
        (foreign(message=b'{"t":-1.0}'), r"t\[0\] must be in"),
        (foreign(message=b'{"t":0.0,"t":0.0}'), "'t' appears twice"),
        (foreign(message=b'{"t":'), "Expecting value"),
        (foreign(message=b"\xff"), "utf-8"),
        (b"", "ends in the middle"),
        (b"not an MCAP file", "invalid magic"),
    ],
)
def test_foreign_files_are_refused_with_a_sentence(path: Path, data: bytes, complaint: str) -> None:
    sentence = refusal(path, data)
    assert re.search(complaint, sentence), sentence


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
        (lambda: Log((Series("/a", T, {}),) * 2, {}, {"a": b"0"}), "several of /a"),
        (lambda: Log((), {"trackable": {}}, {"a": b"0"}), "written by the log itself"),
        (lambda: Log((), {}, {}), "at least one attachment"),
        (lambda: Log((), {}, {"a": b"NaN"}), "attachment 'a' must be JSON: NaN"),
    ],
)
def test_what_breaks_a_rule_is_named(make: Callable[[], object], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        make()


def test_a_series_keeps_its_own_numbers() -> None:
    times, values = np.array([0.0, 1.0]), np.array([1, 2])
    series = Series("/a", times, {"x": values})
    times[0] = values[0] = 9
    assert (series.times.tolist(), series.fields["x"].tolist()) == ([0, 1], [1, 2])
    with pytest.raises(ValueError, match="read-only"):
        series.times[0] = 1


def test_reading_warns_of_nothing(path: Path, data: bytes) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_log(path)
    assert caught == []
