"""Files of other kinds are read if they are packed, or named with what can be done."""

import gzip
import re

import pytest

from trackably.errors import InputError
from trackably.recordings import read_csv
from trackably.recordings.mcap_file import Field, read_mcap

TABLE = b"t,x\n0,1\n1,2\n"
KINDS = {
    "ROS 2 bag": (b"SQLite format 3\0" + bytes(50), "a database, as ROS 2 bags are (.db3): `mcap convert`"),
    "Parquet": (b"PAR1" + bytes(50), "a Parquet file: read_parquet reads it"),
}


@pytest.mark.parametrize(
    "read", [lambda path: read_csv(path, "t", "s", {"x": "x"}), lambda path: read_mcap(path, {"x": Field("/t", "x")})]
)
@pytest.mark.parametrize("kind", KINDS)
def test_other_kinds_are_named(tmp_path, kind, read):
    data, sentence = KINDS[kind]
    (tmp_path / "some").write_bytes(data)
    with pytest.raises(InputError, match=re.escape(f"some: this is {sentence}")):
        read(tmp_path / "some")


def test_gzip_is_unpacked(tmp_path):
    packed, path = gzip.compress(TABLE), tmp_path / "some.csv.gz"
    path.write_bytes(packed)
    assert read_csv(path, "t", "s", {"x": "x"})["x"].values.tolist() == [1.0, 2.0]
    for broken in (packed[:-9], packed[:-1] + b"\xff", packed[:12] + b"\xff" + packed[13:], packed[:3]):
        path.write_bytes(broken)
        with pytest.raises(InputError, match=r"some\.csv\.gz: a gzip file that cannot be unpacked .*; is it whole"):
            read_csv(path, "t", "s", {"x": "x"})
