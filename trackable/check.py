"""The certificate checker on files, for the command line and for notebooks; the checker itself reads no files."""

from pathlib import Path

from trackable.checker import Failed, NotACertificate, Proved, check
from trackable.errors import InputError, NoReferenceError
from trackable.files import from_json, read_bytes


def check_file(path: Path) -> str:
    """Return what the certificate in a file proves, in words.

    Raises NoReferenceError where it proves nothing, and InputError where the file is no certificate.
    """
    try:
        content = from_json(read_bytes(path))
    except ValueError as error:
        raise InputError(f"{path}: is not a certificate: {error}") from error
    if isinstance(content, dict) and "reference" in content and "format" not in content:
        raise InputError(f"{path}: is a saved reference, not a certificate; `save_certificate` writes that of one")
    match check(content):
        case Proved(statement):
            return statement
        case Failed(reason):
            raise NoReferenceError(f"{path}: the certificate does not prove its claim: {reason}")
        case NotACertificate(reason):
            raise InputError(f"{path}: {reason}")
