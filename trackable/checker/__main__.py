"""Check a certificate: `python -m trackable.checker FILE`.

Exit codes: 0 FILE is proved, and what it proves is printed; 1 a step of the proof fails; 2 FILE is not a certificate.
"""

import json
import sys
from io import TextIOWrapper
from pathlib import Path

from trackable.checker import Failed, NotACertificate, Proved, check

_PROVED, _FAILED, _UNUSABLE = 0, 1, 2
_USAGE = f"usage: python -m trackable.checker FILE\n\n{__doc__.split(chr(10), maxsplit=2)[2].strip()}"


def main(arguments: list[str]) -> int:
    """Print what the certificate in a file proves, or why it proves nothing, and return the exit code."""
    match arguments:
        case ["-h" | "--help"]:
            print(_USAGE)
            return _PROVED
        case [path]:
            return _check(path)
    return _say(_USAGE, _UNUSABLE)


def _check(path: str) -> int:
    try:
        verdict = check(_content(Path(path)))
    except OSError as error:
        return _say(f"error: {path}: cannot be read ({error.strerror or error})", _UNUSABLE)
    except ValueError as error:
        return _say(f"error: {path}: is not a certificate: {error}", _UNUSABLE)
    match verdict:
        case Proved(statement):
            print(statement)
            return _PROVED
        case Failed(reason):
            return _say(f"failed: {path}: the certificate does not prove its claim: {reason}", _FAILED)
        case NotACertificate(reason):
            return _say(f"error: {path}: {reason}", _UNUSABLE)


def _say(sentence: str, code: int) -> int:
    print(sentence, file=sys.stderr)
    return code


def _content(path: Path) -> object:
    """Return what a JSON file says. Raise OSError, or ValueError where it is no strict JSON."""
    try:
        content: object = json.loads(
            path.read_bytes().decode(), parse_constant=_refuse_constant, object_pairs_hook=_unique
        )
    except RecursionError as error:
        raise ValueError("JSON nested too deeply") from error
    return content


def _refuse_constant(name: str) -> object:
    raise ValueError(f"{name} is no JSON number")


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found: dict[str, object] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"key {key!r} appears twice in one object")
        found[key] = value
    return found


def run() -> None:
    """Run the command line, and leave Python with its exit code."""
    for stream in (sys.stdout, sys.stderr):  # a bare Python may not write UTF-8 by itself
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding="utf-8")
    sys.exit(main(sys.argv[1:]))


if __name__ == "__main__":
    run()
