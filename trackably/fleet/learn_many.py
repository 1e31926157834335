"""Learn references with proofs from many recordings, and write one table."""

from __future__ import annotations

import dataclasses
import inspect
import json
import os
import signal
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from reprlib import repr as short
from threading import Thread
from typing import Any, TypeVar

from trackably.arguments import instance, whole
from trackably.certificates.claim import Written, as_claim
from trackably.certificates.judge import NotTrackableError
from trackably.certificates.outcome import Counterexample
from trackably.codec import encode_unverified
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.exports.table import put_parquet
from trackably.extras import optional
from trackably.files import path_of, read_bytes
from trackably.fleet.folder import TABLE, FleetFolder, Row, columns, digest, outcome_of, printable
from trackably.fleet.sources import Measured, Source, sources_of
from trackably.gp.kernels.base import Kernel
from trackably.gp.samples import Samples
from trackably.progress import line_of
from trackably.recordings.recording import Recording
from trackably.reference.explanation import IgnoresSamplesWarning
from trackably.reference.learn import learn_reference
from trackably.reference.request import samples_by_name
from trackably.reference.trackable import TrackableReference
from trackably.streams.learn import learn_stream
from trackably.streams.reference import StreamReference
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.tightening import require_plant

# The request that all recordings of a fleet share, and how workers answer it.

Learned = TrackableReference | StreamReference
Learn = Callable[..., Learned]
_KNOWN: tuple[Learn, ...] = learn_reference, learn_stream


@dataclass(frozen=True, eq=False)
class Request:
    """The arguments of `learn` that all recordings share; `options` are its keyword arguments.

    TypeError: `learn` is neither `learn_reference` nor `learn_stream`, or does not take these options, or an argument
    cannot be written as JSON, which is how later runs compare it.
    """

    plant: ConstrainedSystem
    kernel: Kernel | Mapping[str, Kernel]
    claim: Written
    options: Mapping[str, Any]
    learn: Learn = learn_reference

    def __post_init__(self) -> None:
        if self.learn not in _KNOWN:
            raise TypeError(f"learn: expected learn_reference or learn_stream, got {short(self.learn)}")
        try:
            inspect.signature(self.learn).bind("samples", "plant", "kernel", "claim", **self.options)
        except TypeError as error:
            raise TypeError(f"learn_many: {self.learn.__name__}: {error}") from None
        _ = self._shared  # computed here, so that its errors come before anything is learned

    @cached_property
    def _shared(self) -> str:
        return _as_text(
            (version("trackably"), self.learn.__name__, self.plant, self.kernel, repr(self.claim), self.options)
        )

    def fingerprint(self, samples: Mapping[str, Samples]) -> str:
        """Return the SHA-256 of all data that the answer for these samples depends on, as 64 hexadecimal digits."""
        return digest((self._shared + _as_text(samples)).encode())

    def learn_from(self, samples: Mapping[str, Samples]) -> Learned:
        """Return the reference of one recording. Raises and warns as `learn` does."""
        return self.learn(samples, self.plant, self.kernel, self.claim, progress=False, **self.options)


def _as_text(value: object) -> str:
    """Return arguments as JSON. TypeError: one of them cannot be written in this way."""
    try:
        return json.dumps(encode_unverified(value), separators=(",", ":"))
    except TypeError as error:
        raise TypeError(
            f"learn_many: an argument cannot be compared between runs ({error}); give numbers, texts, lists or objects "
            "of this library"
        ) from None


_QUESTIONS = DoubtfulInputWarning, IgnoresSamplesWarning
_UNREAD = "0" * 64  # the digest of a recording that could not be read


def answer(source: Source, request: Request, where: FleetFolder) -> Row:
    """Learn from one recording, write its files, and return its row.

    If an existing row answers the same request, return that row. Errors caused by the recording become a row.
    TypeError: an argument that all recordings share is wrong. Raises OSError.
    """
    kept = where.read_row(source.name)
    with _questions() as asked:
        row, files = _answer(source, request, kept)
    if row is not kept:
        row = dataclasses.replace(row, questions=tuple(asked))
    return row if row == kept else where.write(row, **files)


def _answer(source: Source, request: Request, kept: Row | None) -> tuple[Row, Mapping[str, Callable[[Path], object]]]:
    """Return the row without its questions, and by their names functions that write its files; or the row `kept`."""
    try:
        measured = source.read()
        samples = samples_by_name(measured.signals if isinstance(measured, Recording) else measured, request.plant)
    except (InputError, ValueError, TypeError, OSError) as error:
        return Row(source.name, "unusable", str(error), _UNREAD), {}
    fingerprint = request.fingerprint(samples)
    if kept is not None and kept.request == fingerprint:
        return kept, {}
    try:
        reference = request.learn_from(samples)
    except NotTrackableError as failure:
        is_refuted = isinstance(failure.outcome, Counterexample)
        row = Row(source.name, outcome_of(failure), str(failure), fingerprint)
        return row, {"counterexample": failure.save_counterexample} if is_refuted else {}
    except (ValueError, ArithmeticError) as error:
        return Row(source.name, "unusable", str(error), fingerprint), {}
    row = Row(
        source.name,
        "proved",
        reference.certificate.explanation,
        fingerprint,
        sum(map(len, reference.samples)),
        "stream",
        misfit=reference.misfit,
        hyperparameters=reference.hyperparameters,
        fingerprint=reference.fingerprint,
    )
    if isinstance(reference, TrackableReference):
        of_function = ("method", "objective", "price", "unconstrained_misfit")
        row = dataclasses.replace(row, **{name: getattr(reference, name) for name in of_function})
    return row, {"certificate": reference.save_certificate, "reference": reference.save}


@contextmanager
def _questions() -> Iterator[list[str]]:
    """Collect the texts of this library's warnings in a list; those of other packages are issued at the end."""
    asked: list[str] = []
    with warnings.catch_warnings(record=True) as every:
        for ours in _QUESTIONS:
            warnings.simplefilter("always", ours)
        yield asked
    for each in every:
        if issubclass(each.category, _QUESTIONS):
            asked.append(str(each.message))
        else:
            warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)


_LOOKED_EVERY = 0.5  # seconds between a worker's checks that its parent process runs


def answers(
    sources: Iterable[Source], request: Request, where: FleetFolder, workers: int
) -> Generator[Row, None, None]:
    """Learn from all sources in parallel `workers` (processes), and yield the rows of the results as they are ready.

    They come in any order. When the iterator is closed, remaining work is cancelled. A row does not depend on the
    worker that computes it. MissingExtra: joblib is not installed.
    """
    if workers == 1:
        yield from (answer(source, request, where) for source in sources)
        return
    with optional("workers"):
        from joblib import Parallel, delayed  # noqa: PLC0415

    pool = Parallel(
        n_jobs=workers,
        backend="loky",
        initializer=_begin_worker,
        initargs=(os.getpid(),),
        return_as="generator_unordered",
        batch_size=1,
    )
    found = pool(delayed(answer)(source, request, where) for source in sources)
    try:
        for each in found:  # noqa: UP028  `yield from` would close `found` before the next lines
            yield each
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # joblib warns of tasks that are cancelled
            found.close()


def _begin_worker(parent: int) -> None:
    """Ignore interrupts in a worker, because the parent handles them; exit if the parent was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOKED_EVERY)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


_COUNTED = "{desc}: {n_fmt} of {total_fmt} recordings"
_MOST_SHOWN = 5  # most failures, and most recordings with questions, that are printed

L = TypeVar("L", TrackableReference, StreamReference)


@dataclass(frozen=True)
class Fleet:
    """The results for all recordings, in the order given: `rows`, and in `folder` the files of each and one table.

    A recording NAME has folder/NAME/reference.json, folder/NAME/certificate.json (or counterexample.json) and row.json.
    Certificates of waypoints are in the same folder: certificate.at1.json, certificate.at2.json, …
    A part of NAME, between slashes, that is not in lower case, or has characters that some file system refuses, is
    shortened to readable letters, with a hash behind them: "Monday" is folder/monday~HASH. Files that earlier versions
    wrote under other names are neither read nor removed.
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

        InputError: it has none, `learn_stream` learned it, or the file has changed.
        """
        return self._load(name, TrackableReference)

    def stream(self, name: str) -> StreamReference:
        """Return the reference of a recording that was learned by `learn_stream`. InputError as for `reference`."""
        return self._load(name, StreamReference)

    def _load(self, name: str, kind: type[L]) -> L:
        row = next((row for row in self.rows if row.name == name), None)
        if row is None:
            raise InputError(f"there is no recording {name!r} in {self.folder}")
        if row.outcome != "proved":
            raise InputError(f"{name} is {row.outcome}: {row.sentence}")
        path = FleetFolder(self.folder).of(name) / "reference.json"
        found = kind.load(path) if digest(read_bytes(path)) == row.files.get(path.name) else None
        if found is None or found.fingerprint != row.fingerprint:
            raise InputError(f"{path}: was changed since the row of {name!r} was written; call learn_many again")
        return found

    def columns(self) -> dict[str, list[str | float | int | None]]:
        """Return the table by columns, for example for `pandas.DataFrame(fleet.columns())`."""
        return columns(self.rows)

    def to_parquet(self, path: Path | str) -> None:
        """Write the table as Parquet. MissingExtra: pyarrow is not installed. Raises OSError."""
        put_parquet(self.columns(), path)

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
    shown = [*map(printable, lines[:_MOST_SHOWN])]
    return [*shown, f"… and {len(lines) - _MOST_SHOWN} more"] if len(lines) > _MOST_SHOWN else shown


def learn_many(
    recordings: Mapping[str, Measured] | Iterable[Source],
    plant: ConstrainedSystem,
    kernel: Kernel | Mapping[str, Kernel],
    claim: Written,
    *,
    folder: Path | str,
    learn: Learn = learn_reference,
    workers: int = 1,
    progress: bool = True,
    **options: Any,
) -> Fleet:
    """Learn a reference from each recording, and write references, certificates and a table.

    Earlier answers in the same folder are kept if nothing has changed on which they depend: samples, plant, kernels,
    options and the library's version. So a run that was stopped goes on where it was. A recording that cannot be read,
    or has no reference, becomes a row with a sentence that says why; the others go on. Files and table have the same
    bytes for any number of workers.

    Parameters
    ----------
    recordings
        By name: samples as of `learn_reference`, or a Recording whose signals have the names of states. Or sources
        that are read by the workers: `recordings_in(folder, read)`.
    plant, kernel, claim
        As of `learn_reference`.
    folder
        Where references, certificates and the table are written.
    learn
        `learn_reference`, or `learn_stream` for long recordings, which needs the option `window`.
    workers
        The number of processes on this machine. Several machines can answer parts of the recordings in one folder; a
        call with all recordings then finds these answers, and writes the table.
    progress
        Whether a line on a terminal counts recordings. Elsewhere, the logger "trackably" says it every 10 s (INFO).
    options
        Further arguments of `learn`: noise_std, mean, method, at, disturbance, …

    Raises
    ------
    TypeError, ValueError
        If an argument that all recordings share is wrong.
    InputError
        If joblib is not installed, which several workers need.
    OSError
        If a file cannot be written for another reason than the name of its recording.
    KeyboardInterrupt
        If somebody interrupts; its message says how many recordings are answered.

    """
    require_plant(plant)
    instance("kernel", kernel, Kernel | Mapping, "a kernel, or kernels by name")
    sources, where = sources_of(recordings), FleetFolder(path_of("folder", folder))
    if claim != "recorded":
        as_claim(claim)  # a wrong claim is refused here, and not by each worker
    request = Request(plant, kernel, claim, options, learn)
    processes = whole("workers", workers, least=1)
    found: dict[str, Row] = {}
    where.path.mkdir(parents=True, exist_ok=True)
    try:
        with (
            line_of(_COUNTED, "learn references", len(sources), shown=progress) as line,
            closing(answers(sources, request, where, processes)) as answered,
        ):
            for row in answered:
                found[row.name] = row
                line.update()
    except KeyboardInterrupt:
        kept = f"{len(found)} of {len(sources)} recordings are answered and kept in {where.path}"
        raise KeyboardInterrupt(f"learn_many: {kept}; the same call goes on from there") from None
    rows = tuple(found[source.name] for source in sources)
    where.write_table(rows)
    return Fleet(where.path, rows)
