"""Run the certificate checker on files, for the command line and notebooks; the checker itself reads no files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from trackably import checker
from trackably.arguments import positive
from trackably.checker import Verdict
from trackably.checker.limits import BYTES
from trackably.errors import InputError
from trackably.files import from_json, path_of, read_bytes
from trackably.progress import line_of

_PATIENCE = 3.0  # seconds before a terminal shows the progress of a check


def check(certificate: Path | str | Mapping[str, object], seconds: float | None = None, exact: bool = False) -> Verdict:
    """Check a certificate or a counterexample, given as a file or as its parsed content, and return the verdict.

    `Proved` and `Refuted` say in words what holds; `Failed` and `NotACertificate` say why nothing is shown, `Undecided`
    that the check took longer than `seconds`. An `exact` check uses no float64 intervals; it takes longer. On a
    terminal, a line shows how far a long check is; elsewhere the logger "trackably" says so every 10 s, at level INFO.
    Raises InputError if the file cannot be read, and ValueError if `seconds` is not positive.
    """
    if seconds is not None:
        positive("check: seconds", seconds)
    content = certificate if isinstance(certificate, Mapping) else read(path_of("certificate", certificate))
    with line_of("{desc} {n_fmt} of {total_fmt}", "checked", delay=_PATIENCE, leave=False) as line:

        def progress(done: int, of: int) -> None:
            line.total = of
            line.update(done - line.n)

        return checker.check(content, seconds, progress, exact)


def read(path: Path) -> object:
    """Return the parsed JSON of a certificate's file. InputError: it cannot be read, or holds a saved reference."""
    content: object
    try:
        content = from_json(read_bytes(path, BYTES))
    except ValueError as error:
        raise InputError(f"{path}: is not a certificate: {error}") from error
    if isinstance(content, dict) and "fit" in content and "format" not in content:
        raise InputError(f"{path}: is a saved reference, not a certificate; `save_certificate` writes its certificate")
    return content
