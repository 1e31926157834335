"""Files of other kinds are read if they are packed, or named with what can be done."""

import gzip
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from trackably.errors import InputError
from trackably.recordings import Field, read_csv, read_mcap

TABLE = b"t,x\n0,1\n1,2\n"
KINDS: dict[str, tuple[bytes, str]] = {
    "old spreadsheet": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(50), "an old spreadsheet (.xls): save it as CSV"),
    "ROS 1 bag": (b"#ROSBAG V2.0\n" + bytes(50), "a ROS 1 bag: `mcap convert`"),
    "ROS 2 bag": (b"SQLite format 3\0" + bytes(50), "a database, as ROS 2 bags are (.db3): `mcap convert`"),
    "Parquet": (b"PAR1" + bytes(50), "a Parquet file: save it as CSV"),
    "HDF5": (b"\x89HDF\r\n\x1a\n" + bytes(50), "an HDF5 file, as MATLAB's newer ones are (.mat): save it as CSV"),
    "MATLAB": (b"MATLAB 5.0 MAT-file" + bytes(50), "a MATLAB file (.mat): save it as CSV"),
    "NumPy": (b"\x93NUMPY" + bytes(50), "a NumPy file (.npy): load it, and give its arrays to Samples(times, values)"),
}
READERS: dict[str, Callable[[Path], object]] = {
    "csv": lambda path: read_csv(path, "t", "s", {"x": "x"}),
    "mcap": lambda path: read_mcap(path, {"x": Field("/t", "x")}),
}


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("kind", KINDS)
def test_other_kinds_are_named(tmp_path: Path, kind: str, reader: str) -> None:
    data, sentence = KINDS[kind]
    (tmp_path / "some").write_bytes(data)
    with pytest.raises(InputError, match=re.escape(f"some: this is {sentence}")):
        READERS[reader](tmp_path / "some")


def test_gzip_is_unpacked(tmp_path: Path) -> None:
    packed, path = gzip.compress(TABLE), tmp_path / "some.csv.gz"
    path.write_bytes(packed)
    assert read_csv(path, "t", "s", {"x": "x"})["x"].values.tolist() == [1.0, 2.0]
    for broken in (packed[:-9], packed[:-1] + b"\xff", packed[:12] + b"\xff" + packed[13:], packed[:3]):
        path.write_bytes(broken)
        with pytest.raises(InputError, match=r"some\.csv\.gz: a gzip file that cannot be unpacked .*: is it whole"):
            read_csv(path, "t", "s", {"x": "x"})
