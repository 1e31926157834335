"""Learn references with proofs from many recordings, and write one table."""

from __future__ import annotations

import errno
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from trackably.arguments import instance, text, whole
from trackably.certificates.goal import checked_claim
from trackably.errors import InputError
from trackably.extras import optional
from trackably.files import new_file, path_of, read_bytes, write_atomically
from trackably.fleet.folder import STREAM, TABLE, FleetFolder, Row, columns, digest
from trackably.fleet.request import Answer, Claimed, Learn, Learned, Request, answers
from trackably.fleet.sources import Measured, Source, sources_of
from trackably.gp.kernels.base import Kernel
from trackably.learn import learn_reference
from trackably.progress.bar import recordings_bar
from trackably.reference import TrackableReference
from trackably.request.plant import checked_plant
from trackably.streams.reference import StreamReference
from trackably.systems.constrained import ConstrainedSystem

_MOST_SHOWN = 5  # of the failures, and of the questions
_OF_ONE_NAME = {errno.ENAMETOOLONG, errno.ENOTDIR, errno.EISDIR, errno.EEXIST}  # the rest concerns all recordings

L = TypeVar("L", bound=Learned)


@dataclass(frozen=True)
class Fleet:
    """The results for all recordings, in the order given: `rows`, and in `folder` the files of each and one table.

    A recording NAME has folder/NAME/reference.json, folder/NAME/certificate.json (or counterexample.json) and row.json.
    In NAME, bytes that some file systems refuse are written as %XX, and an empty part between slashes as %. A part with
    capital letters ends with ^ and a number that gives their positions: "/Monday" is folder/%/Monday^1. Files in other
    places, which versions before this rule wrote, are neither read nor removed.
    """

    folder: Path
    rows: tuple[Row, ...]

    @property
    def table(self) -> Path:
        """The table as CSV, with one line for each recording, including failures."""
        return self.folder / TABLE

    def __iter__(self) -> Iterator[Row]:
        """Yield the rows, in the order given."""
        return iter(self.rows)

    @property
    def proved(self) -> tuple[Row, ...]:
        """The rows of recordings with a trackable reference."""
        return tuple(row for row in self.rows if row.outcome == "proved")

    def reference(self, name: str) -> TrackableReference:
        """Return the reference of a recording, after proving it again.

        InputError: it has none, or the file has changed.
        """
        return self._loaded(name, TrackableReference.load, is_stream=False)

    def stream(self, name: str) -> StreamReference:
        """Return the reference of a recording that was learned by `learn_stream`. InputError as for `reference`."""
        return self._loaded(name, StreamReference.load, is_stream=True)

    def _loaded(self, name: str, load: Callable[[Path], L], *, is_stream: bool) -> L:
        row = next((row for row in self.rows if row.name == name), None)
        if row is None:
            raise InputError(f"there is no recording {name!r} in {self.folder}")
        if row.outcome != "proved":
            raise InputError(f"{name} is {row.outcome}: {row.sentence}")
        if (row.method == STREAM) is not is_stream:
            raise InputError(
                f"{name}: call fleet.{'reference' if is_stream else 'stream'}({name!r}), as it was learned"
            )
        path = FleetFolder(self.folder).of(name) / "reference.json"
        is_same = digest(read_bytes(path)) == row.files.get(path.name)
        found = load(path) if is_same else None
        if found is None or found.fingerprint != row.fingerprint:
            raise InputError(f"{path}: was changed since the row of {name!r} was written; call learn_many again")
        return found

    def columns(self) -> dict[str, list[str | float | int | None]]:
        """Return the table by columns, for example for `pandas.DataFrame(fleet.columns())`."""
        return columns(self.rows)

    def to_parquet(self, path: Path | str) -> None:
        """Write the table as Parquet. MissingExtra: pyarrow is not installed. Raises OSError."""
        with optional("to_parquet"):
            import pyarrow  # noqa: PLC0415
            from pyarrow import parquet  # noqa: PLC0415
        content = pyarrow.BufferOutputStream()
        parquet.write_table(pyarrow.table(self.columns()), content)
        write_atomically(new_file("to_parquet", path), content.getvalue().to_pybytes())

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        return f"Fleet({self})"

    def __str__(self) -> str:
        failed = [row for row in self.rows if row.outcome != "proved"]
        lines = [f"{len(self.proved)} of {len(self)} references are proved; the table is {self.table}"]
        lines += _first([f"{row.name}: {row.outcome}: {row.sentence}" for row in failed])
        asked = [f"{row.name}: proved, but {'; '.join(row.questions)}" for row in self.proved if row.questions]
        return "\n".join(lines + _first(asked))


def _first(lines: list[str]) -> list[str]:
    """Return the first lines, and a line on how many more there are; unprintable characters are escaped."""
    shown = ["".join(c if c.isprintable() else ascii(c)[1:-1] for c in line) for line in lines[:_MOST_SHOWN]]
    return [*shown, f"… and {len(lines) - _MOST_SHOWN} more"] if len(lines) > _MOST_SHOWN else shown


def learn_many(
    recordings: Mapping[str, Measured] | Iterable[Source],
    plant: ConstrainedSystem,
    kernel: Kernel | Mapping[str, Kernel],
    claim: Claimed,
    *,
    folder: Path | str,
    learn: Learn = learn_reference,
    workers: int = 1,
    cluster: str | None = None,
    progress: bool = True,
    **options: Any,
) -> Fleet:
    """Learn a reference from each recording, and write references, certificates and a table.

    What was answered before in the same folder is kept if nothing has changed on which it depends: samples, plant,
    kernels, options and the library's version. So a run that was stopped goes on where it was. A recording that cannot
    be read, or has no reference, becomes a row with its sentence; the others go on. Files and table have the same bytes
    whatever the number of workers.

    Parameters
    ----------
    recordings
        By name: Samples, samples by name, or a Recording whose signals have the names of states. Or sources that are
        read by the workers: `recordings_in(folder, read)`, `parts_of_csv`, `parts_of_parquet`, `topics_of`.
    plant, kernel, claim
        As of `learn_reference`. The claim "recorded" is the window from the first sample of a recording to its last, or
        from the step before to the step after.
    folder
        Where references, certificates and the table are written.
    learn
        `learn_reference`, or `learn_stream` for long recordings, which needs the option `window`.
    workers
        The number of processes on this machine.
    cluster
        The address of a Dask scheduler, as "tcp://10.0.0.1:8786": its workers learn, and files are written here.
    progress
        Whether a line on a terminal counts recordings. Elsewhere, the logger "trackably" says it every 10 s (INFO).
    options
        Further arguments of `learn`: noise_std, mean, method, at, disturbance, …

    Raises
    ------
    TypeError, ValueError
        Where an argument that all recordings share is wrong.
    InputError
        Where packages for a cluster are not installed.
    OSError
        Where a file cannot be written, and another name would not help.
    KeyboardInterrupt
        Where somebody interrupts: with a sentence that says how many recordings are answered.

    """
    checked_plant(plant)
    instance("kernel", kernel, Kernel | Mapping, "a kernel, or kernels by name")
    if "progress" in options:
        raise TypeError("learn_many: progress is given twice")
    sources, where = sources_of(recordings), FleetFolder(path_of("folder", folder))
    request = Request(plant, kernel, claim if claim == "recorded" else checked_claim(claim), options, learn)
    processes = whole("workers", workers, least=1)
    address = None if cluster is None else text("cluster", cluster)
    asked = [(source, where.kept(source.name)) for source in sources]
    found: dict[str, Row] = {}
    where.path.mkdir(parents=True, exist_ok=True)
    try:
        with (
            recordings_bar("learn references", len(sources), shown=progress) as count,
            closing(answers(asked, request, processes, address)) as answered,
        ):
            for each in answered:
                found[each.row.name] = each.row if each.is_kept else _write_answer(where, each)
                count()
    except KeyboardInterrupt:
        kept = f"{len(found)} of {len(sources)} recordings are answered and kept in {where.path}"
        raise KeyboardInterrupt(f"learn_many: {kept}; the same call goes on from there") from None
    rows = tuple(found[source.name] for source in sources)
    where.write_table(rows)
    return Fleet(where.path, rows)


def _write_answer(where: FleetFolder, answer: Answer) -> Row:
    """Write an answer and return its row; if its folder cannot have this name, return a row that says so."""
    try:
        where.write(answer.row, answer.files)
    except OSError as error:
        if error.errno not in _OF_ONE_NAME:
            raise
        why = f"give it another name: its folder cannot be written ({error.strerror})"
        return Row(answer.row.name, "unusable", why, answer.row.request)
    return answer.row
