"""Files of other kinds are read if they are packed, or named with what can be done."""

import gzip
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from trackably.errors import InputError
from trackably.recordings import KITTI, TUM, Column, CsvLayout, Field, frames, read_csv, read_mcap

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


TRAJECTORY = (
    "# ground truth\n# timestamp tx ty tz qx qy qz qw\n"
    "1305031102.1753 0.5 1 2 0 0 0 1\n1305031102.2753  0.75 1 2 0 0 0 1 \n"
)
POSES = "1 0 0 0.5 0 1 0 -1 0 0 1 2\n1 0 0 0.75 0 1 0 -1.5 0 0 1 2.5e+00\n"


def test_trajectories_without_a_header(tmp_path: Path) -> None:
    (tmp_path / "tum.txt").write_text(TRAJECTORY)
    (tmp_path / "kitti.txt").write_text(POSES)
    tum = read_csv(tmp_path / "tum.txt", "t", "epoch s", {"x": "x"}, TUM)
    assert tum["x"].times.tolist() == [0.0, 0.1]
    assert tum["x"].values.tolist() == [0.5, 0.75]
    kitti = read_csv(tmp_path / "kitti.txt", None, frames(10), {"x": Column("x", 2.0), "z": "z"}, KITTI)
    assert kitti["z"].times.tolist() == [0.0, 0.1]
    assert kitti["z"].values.tolist() == [2.0, 2.5]


def test_names_in_the_layout(tmp_path: Path) -> None:
    path = tmp_path / "some.csv"
    path.write_text("0;1\n1;2\n")
    assert read_csv(path, "t", "s", {"x": "x"}, CsvLayout(columns=["t", "x"]))["x"].values.tolist() == [1.0, 2.0]
    for layout, time, unit, said in (
        (CsvLayout(columns=["x"]), None, "s", "line 1: expected 1 cells, as the layout names, got 2"),
        (CsvLayout(columns=["t", "y"]), "t", "s", "there is no column 'x'; with the separator ';' there are 't', 'y'"),
        (CsvLayout(), "t", "s", "if these are values, the file has no header, and `columns` of the layout names"),
        (CsvLayout(columns=["t", "x"]), None, "ISO 8601", "time=None counts rows, and no count is a date"),
    ):
        with pytest.raises(InputError, match=re.escape(said)):
            read_csv(path, time, unit, {"x": "x"}, layout)


def test_a_header_below_a_title_is_pointed_out(tmp_path: Path) -> None:
    path = tmp_path / "titled.csv"
    path.write_text("measured on Monday\n\nt;x\n0;1\n")
    said = "there are 'measured on Monday'; line 3 names all of them: `skip` of the layout leaves out the lines above"
    with pytest.raises(InputError, match=re.escape(said)):
        read_csv(path, "t", "s", {"x": "x"})
    assert read_csv(path, "t", "s", {"x": "x"}, CsvLayout(skip=[1]))["x"].values.tolist() == [1.0]
    with pytest.raises(InputError, match=r"there are 'measured on Monday'$"):
        read_csv(path, "t", "s", {"x": "y"})
