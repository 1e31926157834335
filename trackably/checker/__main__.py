"""Check a certificate, or a counterexample: `python -m trackably.checker [--seconds N] [--exact] FILE`.

With --exact, and without NumPy, float64 intervals are not used: all is done in mpmath, which takes longer.
Exit codes: 0 FILE is proved, and what it proves is printed; 1 a step of the proof fails; 2 FILE is not a certificate;
3 not decided within N seconds; 4 FILE is a valid counterexample: its reference is not trackable; 5 FILE
is a valid contradiction: no reference keeps its bounds and values; 130 interrupted.
"""

import sys
from io import TextIOWrapper
from math import isfinite
from pathlib import Path
from reprlib import repr as short

from trackably.checker import Contradicted, Failed, NotACertificate, Proved, Refuted, Undecided, Verdict, check
from trackably.checker.form import from_json
from trackably.checker.limits import BYTES
from trackably.checker.watch import ProgressLine

PROVED, FAILED, UNUSABLE, UNDECIDED, REFUTED, IMPOSSIBLE, INTERRUPTED = 0, 1, 2, 3, 4, 5, 130
_EXPLAINED = __doc__.split("\n", maxsplit=2)[2].strip()
_USAGE = f"usage: python -m trackably.checker [--seconds N] [--exact] FILE\n\n{_EXPLAINED}"


def main(arguments: list[str]) -> int:
    """Check the named file, print what it proves or why it proves nothing, and return the exit code."""
    exact, arguments = "--exact" in arguments, [argument for argument in arguments if argument != "--exact"]
    match arguments:
        case ["-h" | "--help"]:
            print(_USAGE)
            return PROVED
        case ["--seconds", given, path] | [path, "--seconds", given]:
            if (seconds := _positive(given)) is None:
                return _say(f"error: --seconds must be a positive number, got {short(given)}", UNUSABLE)
            return _check(path, seconds, exact)
        case [path]:
            return _check(path, None, exact)
    return _say(_USAGE, UNUSABLE)


def _check(path: str, seconds: float | None, exact: bool) -> int:
    line = ProgressLine()
    verdict: Verdict
    try:
        verdict = check(_content(Path(path)), seconds, line, exact)
    except OSError as error:
        verdict = NotACertificate(f"cannot be read ({error.strerror or error})")
    except ValueError as error:
        verdict = NotACertificate(f"is not a certificate: {error}")
    finally:
        line.clear()
    return report(verdict, path)


def report(verdict: Verdict, path: object) -> int:
    """Print a verdict about a file, and return the exit code."""
    match verdict:
        case Proved(statement) | Refuted(statement) | Contradicted(statement):
            print(statement)
            return {Proved: PROVED, Refuted: REFUTED, Contradicted: IMPOSSIBLE}[type(verdict)]
        case Failed():
            return _say(f"failed: {path}: {verdict.sentence}", FAILED)
        case NotACertificate(reason):
            return _say(f"error: {path}: {reason}", UNUSABLE)
        case Undecided(reason):
            return _say(f"undecided: {path}: {reason}", UNDECIDED)


def _say(sentence: str, code: int) -> int:
    print(sentence, file=sys.stderr)
    return code


def _positive(given: str) -> float | None:
    """Return a text as a number of seconds; None if it is no positive, finite number."""
    try:
        seconds = float(given)
    except ValueError:
        return None
    return seconds if seconds > 0 and isfinite(seconds) else None


def _content(path: Path) -> object:
    """Return the content of a JSON file. Raise OSError, or ValueError if it is no strict JSON or too long."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise ValueError("expected a file, got a device or a pipe, which may have no end")
    with path.open("rb") as file:
        data = file.read(BYTES + 1)
    if len(data) > BYTES:
        raise ValueError(f"it has more than {BYTES} bytes")
    return from_json(data)


def run() -> None:
    """Run the command line, and leave Python with its exit code."""
    for stream in (sys.stdout, sys.stderr):  # otherwise Python may fail to write some characters
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")
    try:
        code = main(sys.argv[1:])
    except KeyboardInterrupt:
        code = INTERRUPTED
    sys.exit(code)


if __name__ == "__main__":
    run()
