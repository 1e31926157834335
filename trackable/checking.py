"""The certificate checker on files, for the command line and for notebooks; the checker itself reads no files."""

from collections.abc import Mapping
from pathlib import Path

from trackable import checker
from trackable.checker import Failed, NotACertificate, Proved, Verdict
from trackable.errors import InputError, NoReferenceError
from trackable.files import from_json, path_of, read_bytes


def check(certificate: Path | str | Mapping[str, object]) -> Verdict:
    """Check a certificate, given as a file or as the content of one, and return the verdict.

    `Proved` says in words what holds; `Failed` and `NotACertificate` say why nothing is proved. Raises InputError where
    the file cannot be read.
    """
    return checker.check(
        certificate if isinstance(certificate, Mapping) else _read(path_of("certificate", certificate))
    )


def check_file(path: Path | str) -> str:
    """Return what the certificate in a file proves, in words.

    Raises NoReferenceError where it proves nothing, and InputError where the file is no certificate.
    """
    path = path_of("certificate", path)
    match checker.check(_read(path)):
        case Proved(statement):
            return statement
        case Failed(reason):
            raise NoReferenceError(f"{path}: the certificate does not prove its claim: {reason}")
        case NotACertificate(reason):
            raise InputError(f"{path}: {reason}")


def _read(path: Path) -> object:
    try:
        content: object = from_json(read_bytes(path))
    except ValueError as error:
        raise InputError(f"{path}: is not a certificate: {error}") from error
    if isinstance(content, dict) and "fit" in content and "format" not in content:
        raise InputError(f"{path}: is a saved reference, not a certificate; `save_certificate` writes that of one")
    return content
