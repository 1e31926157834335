"""The library's command line: `python -m trackably check FILE`, `python -m trackably theorem FILE`."""

import signal

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # background jobs ignore it
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends the imports below without a traceback

import argparse
import sys
from pathlib import Path

from trackably.checker.__main__ import INTERRUPTED, UNUSABLE, report
from trackably.checking import check
from trackably.errors import InputError
from trackably.files import write_text
from trackably.theorem import SILENT, theorem

_CODES = """Exit codes: 0 FILE is proved, and what it proves is printed; 1 a step of the proof fails; 2 FILE cannot be
used; 3 not decided within N seconds; 4 FILE is a valid counterexample: its reference is not trackable; 5 FILE
is a valid contradiction: no reference keeps its bounds and values; 130 interrupted. With several files, the exit
code is the largest of their codes: 0 only if all are proved.
"""


def main(arguments: list[str]) -> int:
    """Run a command and return its exit code; `--help` lists the codes."""
    parser = argparse.ArgumentParser(prog="python -m trackably", description="Check proofs, and hand them to Coq.")
    commands = parser.add_subparsers(dest="command", required=True)
    written = "what `save_certificate`, `save_counterexample` or `save_contradiction` wrote"
    checking = commands.add_parser(
        "check",
        help="check a certificate or a counterexample; the checker shares no code with what found it",
        epilog=_CODES,
    )
    checking.add_argument("files", type=Path, metavar="FILE", nargs="+", help=written)
    checking.add_argument(
        "--seconds", type=float, metavar="N", help="stop after about N seconds; the exit code is 3 if undecided"
    )
    checking.add_argument("--exact", action="store_true", help="check without float64 intervals; takes longer")
    stating = commands.add_parser("theorem", help="write a certificate as a file for the proof assistant Coq")
    stating.add_argument("file", type=Path, metavar="FILE", help=written)
    stating.add_argument(
        "--output", type=Path, metavar="COQ", help="file to write; by default FILE's name with .v, in this folder"
    )
    stating.add_argument(
        "--emulated", action="store_true", help="let Coq emulate float64, and not use the processor's; takes longer"
    )
    given = parser.parse_args(arguments)
    try:
        if given.command == "theorem":
            return _state(given.file, given.output or Path(f"{given.file.stem}.v"), given.emulated)
    except (InputError, ValueError) as error:
        return _refuse(error)
    return max(_check(file, given, len(given.files) > 1) for file in given.files)


def _check(file: Path, given: argparse.Namespace, is_named: bool) -> int:
    """Print the verdict about a file, below its name if `is_named`, and return the exit code."""
    try:
        verdict = check(file, given.seconds, given.exact)
    except (InputError, ValueError) as error:
        return _refuse(error)
    if is_named:
        print(f"{file}:", flush=True)
    return report(verdict, file)


def _refuse(error: Exception) -> int:
    print(f"error: {error}", file=sys.stderr)
    return UNUSABLE


def _state(file: Path, output: Path, emulated: bool) -> int:
    stated = theorem(file, emulated)
    write_text(output, stated.text)
    print(f"wrote {output}. With Coq's files of `theorem/`, which `make theorem` compiles, this proves it:")
    print(f"  coqc -Q theorem Trackably {output}\nIts statement has the SHA-256 {stated.fingerprint}. {SILENT}")
    return 0


if __name__ == "__main__":
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        code = main(sys.argv[1:])
    except KeyboardInterrupt:
        code = INTERRUPTED
    sys.exit(code)
