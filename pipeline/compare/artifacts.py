"""Find the artifacts of a folder, and compare each with its counterpart."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from pipeline.compare.content.documents import csv_parts, json_parts, read_csv, read_json
from pipeline.compare.content.notebooks import notebook_parts, read_notebook
from pipeline.compare.content.raster import picture_parts, read_picture
from pipeline.compare.content.recordings import read_recording, recording_parts
from pipeline.compare.content.values import Leaf, Part, UnreadableError, judge
from pipeline.compare.content.vector import drawing_parts, read_drawing
from pipeline.compare.model import Row, Status
from pipeline.compare.tolerances import Tolerances
from pipeline.storage.results import ENVIRONMENT, TIMINGS

RESULTS, NOTEBOOKS = Path("data/results"), Path("notebooks")


@dataclass(frozen=True)
class Kind:
    """How files of a kind are read and divided into parts. A `divided` file has one row for each part."""

    read: Callable[[Path], Any]
    parts: Callable[[Any, Any], Iterable[Part]]
    divided: bool = False


def _bytes(read: Callable[[bytes], Any]) -> Callable[[Path], Any]:
    return lambda path: read(path.read_bytes())


def _hash_parts(base: bytes, new: bytes) -> list[Part]:
    base_leaf, new_leaf = ({"SHA-256": Leaf("bytes", sha256(data).hexdigest())} for data in (base, new))
    return [Part("", "", base_leaf, new_leaf)]


KINDS: Mapping[str, Kind] = {
    ".json": Kind(_bytes(read_json), json_parts),
    ".csv": Kind(_bytes(read_csv), csv_parts),
    ".mcap": Kind(read_recording, recording_parts, divided=True),
    ".svg": Kind(_bytes(read_drawing), drawing_parts),
    ".png": Kind(_bytes(read_picture), picture_parts),
    ".ipynb": Kind(_bytes(read_notebook), notebook_parts),
}
_ANY = Kind(_bytes(bytes), _hash_parts)


def artifacts(root: Path) -> dict[str, Path]:
    """Return the artifacts below a folder by name: `example1/metrics.json`, `notebooks/example1.ipynb`.

    The folder is that of a project, or of its results alone. Hidden files, wall clocks and records of the environment
    are no artifacts.
    """
    results = results_folder(root)
    named = {path.relative_to(results).as_posix(): path for path in _files(results)}
    if results != root:
        named |= {path.relative_to(root).as_posix(): path for path in _files(root / NOTEBOOKS)}
    return named


def results_folder(root: Path) -> Path:
    """Return the results folder of a project, or the folder itself where it is no project."""
    return root / RESULTS if (root / RESULTS).is_dir() else root


_NO_ARTIFACTS = {TIMINGS, ENVIRONMENT}
"""Durations on one machine are not compared, and the environment is compared by itself."""


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.is_file() and not hidden and path.name not in _NO_ARTIFACTS:
            yield path


def artifact_rows(name: str, base: Path | None, new: Path | None, tolerances: Tolerances) -> list[Row]:
    """Return the rows of one artifact, whose file may be missing on one side."""
    if base is None or new is None:
        return [Row(name, "", "", Status.EXTRA if base is None else Status.MISSING)]
    kind = KINDS.get(Path(name).suffix, _ANY)
    same = base.read_bytes() == new.read_bytes()
    if same and not kind.divided:
        return [Row(name, "", "", Status.IDENTICAL)]
    sides, complaints = [], []
    for labels, path in ((("BASE", "NEW"), base),) if same else ((("BASE",), base), (("NEW",), new)):
        try:
            sides += [kind.read(path)] * len(labels)
        except UnreadableError as error:
            complaints += [f"cannot be read in {label}: {error}" for label in labels]
    if not complaints:
        try:
            rows = [judge(name, part, tolerances) for part in kind.parts(*sides)]
        except UnreadableError as error:
            complaints.append(f"cannot be read: {error}")
    if complaints:
        return [Row(name, "", "", Status.DIFFERENT, notes=tuple(complaints))]
    if not same and all(row.status is Status.IDENTICAL for row in rows):
        note = "the same content in other bytes"
        if not kind.divided:
            return [Row(name, "", "", Status.WITHIN, compared=rows[0].compared, notes=(*rows[0].notes, note))]
        rows.append(Row(name, "", "", Status.WITHIN, notes=(note,)))
    return rows
