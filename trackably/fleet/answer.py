"""Answer one recording: what a worker does, and sends back."""

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from trackably.certificates.judge import NotTrackableError
from trackably.certificates.outcome import Counterexample
from trackably.errors import DoubtfulInputWarning, InputError
from trackably.explanation import IgnoresSamplesWarning
from trackably.fleet.folder import digest
from trackably.fleet.request import Request
from trackably.fleet.row import Row, outcome_of
from trackably.fleet.sources import Measured, Source
from trackably.gp.samples import Samples
from trackably.recordings.recording import Recording

_UNREAD = "0" * 64  # no content, so nothing is known again


@dataclass(frozen=True)
class Answer:
    """A recording's row, and the content of its files by their names; `is_kept` where both were there before."""

    row: Row
    files: Mapping[str, bytes]
    is_kept: bool = False


def answer(source: Source, request: Request, kept: Row | None) -> Answer:
    """Learn from one recording, unless `kept` is the answer to the same request.

    What the recording is to blame for becomes a row. TypeError: an argument that all recordings share is wrong.
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
            files = _saved(counterexample=failure.save_counterexample) if is_refuted else {}
            row = Row(source.name, outcome_of(failure), str(failure), fingerprint, files=_digests(files))
            return Answer(row, files)
        except (ValueError, ArithmeticError) as error:
            return Answer(Row(source.name, "unusable", str(error), fingerprint), {})
    files = _saved(certificate=reference.save_certificate, reference=reference.save)
    return Answer(Row.of_proved(source.name, fingerprint, reference, tuple(questions), _digests(files)), files)


def _samples(measured: Measured) -> Samples | Mapping[str, Samples]:
    if isinstance(measured, Recording):
        return {name: measured.samples(name) for name in measured.signals}
    if isinstance(measured, Samples | Mapping):
        return measured
    raise TypeError(f"expected Samples, samples by name or a Recording, got {type(measured).__name__}")


@contextmanager
def _questions() -> Iterator[list[str]]:
    """Collect the sentences of the library's warnings; other warnings go where they always go."""
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


def _saved(**saves: Callable[[Path], object]) -> dict[str, bytes]:
    """Return what each of these writes as `name`.json."""
    with TemporaryDirectory() as folder:
        paths = {Path(folder) / f"{name}.json": save for name, save in saves.items()}
        for path, save in paths.items():
            save(path)
        return {path.name: path.read_bytes() for path in paths}


def _digests(files: Mapping[str, bytes]) -> dict[str, str]:
    return {name: digest(content) for name, content in files.items()}
