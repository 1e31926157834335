"""The certificate checker on files: the checker itself knows no files and nothing else of this project."""

from pathlib import Path

from trackable.checker import Failed, NotACertificate, Proved, check
from trackable.errors import InputError, NoReferenceError
from trackable.files import from_json, read_bytes


def check_file(path: Path) -> str:
    """What the certificate in a file proves. NoReferenceError where it proves nothing, InputError where it is none."""
    try:
        content = from_json(read_bytes(path))
    except ValueError as error:
        raise InputError(f"{path}: is not a certificate: {error}") from error
    if isinstance(content, dict) and "reference" in content:
        raise InputError(f"{path}: is a saved reference, not a certificate; `save_certificate` writes that of one")
    match check(content):
        case Proved(statement):
            return statement
        case Failed(reason):
            raise NoReferenceError(f"{path}: the certificate does not prove its claim: {reason}")
        case NotACertificate(reason):
            raise InputError(f"{path}: is not a certificate: {reason}")
