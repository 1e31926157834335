"""The request that all recordings of a fleet share, and how workers answer it."""

import dataclasses
import hashlib
import inspect
import json
import math
import os
import signal
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from reprlib import repr as short
from tempfile import TemporaryDirectory
from threading import Thread
from typing import Any, Literal
from warnings import catch_warnings, simplefilter

import numpy as np

from trackably.certificates.goal import Claim
from trackably.certificates.judge import NotTrackableError
from trackably.certificates.outcome import Counterexample
from trackably.codec import encode
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.explanation import IgnoresSamplesWarning
from trackably.extras import optional
from trackably.fleet.folder import Row, digest, outcome_of
from trackably.fleet.sources import Measured, Source
from trackably.gp.kernels.base import Kernel
from trackably.gp.samples import Samples
from trackably.learn import learn_reference
from trackably.recordings.recording import Recording
from trackably.reference import TrackableReference
from trackably.streams.learn import learn_stream
from trackably.streams.reference import StreamReference
from trackably.systems.constrained import ConstrainedSystem

Claimed = Claim | Literal["recorded"]
"""A claim as of `learn_reference`; "recorded" is the window from the first sample of each recording to its last.

Where these are between two steps, it begins at the step before, and ends at the step after them.
"""

_ROUNDING = 1e-9  # steps

Learned = TrackableReference | StreamReference
Learn = Callable[..., Learned]
_KNOWN: tuple[Learn, ...] = learn_reference, learn_stream


@dataclass(frozen=True, eq=False)
class Request:
    """The arguments of `learn` that all recordings share; `options` are its keyword arguments.

    TypeError: `learn` is neither `learn_reference` nor `learn_stream`, or an argument cannot be compared between runs.
    """

    plant: ConstrainedSystem
    kernel: Kernel | Mapping[str, Kernel]
    claim: Claimed
    options: Mapping[str, Any]
    learn: Learn = learn_reference

    def __post_init__(self) -> None:
        if self.learn not in _KNOWN:
            raise TypeError(f"learn: expected learn_reference or learn_stream, got {short(self.learn)}")
        _refuse_options(self.options, self.learn)
        _ = self._shared  # found now, to raise its error before anything is learned

    @cached_property
    def _shared(self) -> Any:
        return _plain(
            {
                "trackably": version("trackably"),
                "learn": getattr(self.learn, "__name__", ""),
                "plant": self.plant,
                "kernel": self.kernel,
                "claim": self.claim,
                "options": dict(self.options),
            }
        )

    def fingerprint(self, samples: Samples | Mapping[str, Samples]) -> str:
        """Return the SHA-256 of all data that the answer for these samples depends on, as 64 hexadecimal digits."""
        content = json.dumps([self._shared, _plain(samples)], sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(content.encode()).hexdigest()

    def learned(self, samples: Samples | Mapping[str, Samples]) -> Learned:
        """Return the reference of one recording. Raises and warns as `learn` does."""
        claim = _recorded(samples, self.plant.system.sampling_time) if self.claim == "recorded" else self.claim
        return self.learn(samples, self.plant, self.kernel, claim, progress=False, **self.options)


def _refuse_options(options: Mapping[str, object], learn: Learn) -> None:
    """Raise TypeError for an option that `learn` does not take, and for a missing one."""
    try:
        inspect.signature(learn).bind("samples", "plant", "kernel", "claim", **options)
    except TypeError as error:
        raise TypeError(f"learn_many: {learn.__name__}: {error}") from None


def _recorded(samples: Samples | Mapping[str, Samples], step: float) -> tuple[float, float]:
    """Return the times [s] of the first and the last sample, moved outwards to steps, at which a
    control loop evaluates.
    """
    times = [of.times for of in ([samples] if isinstance(samples, Samples) else samples.values())]
    first, last = float(min(each[0] for each in times)), float(max(each[-1] for each in times))
    before, after = math.floor(first / step + _ROUNDING), math.ceil(last / step - _ROUNDING)
    return min(first, before * step), max(last, after * step)


def _plain(value: object) -> Any:
    """Return an argument as nested lists, dicts, texts and numbers. TypeError: it has no such form."""
    match value:
        case None | bool() | int() | float() | str():
            return value
        case Mapping():
            return [[_plain(key), _plain(inner)] for key, inner in value.items()]
        case tuple() | list():
            return [_plain(inner) for inner in value]
        case np.ndarray() | np.generic():
            return value.tolist()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [type(value).__name__, encode(value)]
    raise TypeError(f"learn_many: cannot compare an argument of type {type(value).__name__} between runs")


_UNREAD = "0" * 64  # the digest of a recording that could not be read


@dataclass(frozen=True)
class Answer:
    """A recording's row, and the contents of its files by name; `is_kept` if both already existed."""

    row: Row
    files: Mapping[str, bytes]
    is_kept: bool = False


def answer(source: Source, request: Request, kept: Row | None) -> Answer:
    """Learn from one recording, unless `kept` is the answer to the same request.

    Errors caused by the recording become a row. TypeError: an argument that all recordings share is wrong.
    """
    try:
        samples = _samples(source.read())
    except (InputError, ValueError, TypeError, OSError) as error:
        row = Row(source.name, "unusable", str(error), _UNREAD)
        return Answer(row, {}, is_kept=row == kept)
    fingerprint = request.fingerprint(samples)
    if kept is not None and kept.request == fingerprint:
        return Answer(kept, {}, is_kept=True)
    with _questions() as questions:
        try:
            reference = request.learned(samples)
        except NotTrackableError as failure:
            is_refuted = isinstance(failure.outcome, Counterexample)
            files = _file_contents(counterexample=failure.save_counterexample) if is_refuted else {}
            row = Row(source.name, outcome_of(failure), str(failure), fingerprint, files=_digests(files))
            return Answer(row, files)
        except (ValueError, ArithmeticError) as error:
            return Answer(Row(source.name, "unusable", str(error), fingerprint), {})
    files = _file_contents(certificate=reference.save_certificate, reference=reference.save)
    return Answer(Row.of_proved(source.name, fingerprint, reference, tuple(questions), _digests(files)), files)


def _samples(measured: Measured) -> Samples | Mapping[str, Samples]:
    if isinstance(measured, Recording):
        return {name: measured.samples(name) for name in measured.signals}
    if isinstance(measured, Samples | Mapping):
        return measured
    raise TypeError(f"expected Samples, samples by name or a Recording, got {type(measured).__name__}")


@contextmanager
def _questions() -> Iterator[list[str]]:
    """Collect the sentences of the library's warnings; issue other warnings as usual."""
    asked: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DoubtfulInputWarning)
        warnings.simplefilter("always", IgnoresSamplesWarning)
        yield asked
        asked += [str(each.message) for each in caught if isinstance(each.message, _OURS)]
    for each in caught:
        if not isinstance(each.message, _OURS):
            warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)


_OURS = (DoubtfulInputWarning, IgnoresSamplesWarning)


def _file_contents(**saves: Callable[[Path], object]) -> dict[str, bytes]:
    """Return the contents that each of these functions writes to `name`.json."""
    with TemporaryDirectory() as folder:
        paths = {Path(folder) / f"{name}.json": save for name, save in saves.items()}
        for path, save in paths.items():
            save(path)
        return {path.name: path.read_bytes() for path in paths}


def _digests(files: Mapping[str, bytes]) -> dict[str, str]:
    return {name: digest(content) for name, content in files.items()}


_LOOKED_EVERY = 0.5  # seconds between a worker's checks that its parent process runs


def answers(
    asked: Iterable[tuple[Source, Row | None]], request: Request, workers: int, cluster: str | None
) -> Generator[Answer, None, None]:
    """Yield answers as they are ready, in any order. MissingExtra: joblib or distributed is not installed.

    When the iterator is closed, remaining work is cancelled. An answer does not depend on the worker that computes it.
    """
    if cluster is None and workers == 1:
        yield from (answer(source, request, kept) for source, kept in asked)
        return
    with optional("workers"):
        from joblib import Parallel, delayed  # noqa: PLC0415

    here: dict[str, Any] = {"backend": "loky", "initializer": _begin_worker, "initargs": (os.getpid(),)}
    with _on(cluster):
        pool = Parallel(
            n_jobs=-1 if cluster else workers,
            return_as="generator_unordered",
            batch_size=1,
            **({} if cluster else here),
        )
        found = pool(delayed(answer)(source, request, kept) for source, kept in asked)
        try:
            for each in found:  # noqa: UP028  `yield from` would close `found` before the next lines
                yield each
        finally:
            with catch_warnings():
                simplefilter("ignore")  # joblib warns of what is given up
                found.close()


def _begin_worker(parent: int) -> None:
    """Ignore interrupts in a worker, because the parent handles them; exit if the parent was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOKED_EVERY)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def _on(cluster: str | None) -> Iterator[None]:
    """Send joblib's tasks in this context to a Dask cluster, if one is given."""
    if cluster is None:
        yield
        return
    with optional("cluster"):
        from distributed import Client  # noqa: PLC0415
        from joblib import parallel_config  # noqa: PLC0415

    client = Client(cluster)  # type: ignore[no-untyped-call]
    with client, parallel_config(backend="dask"):
        yield
