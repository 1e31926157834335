"""The library's command line: `python -m trackably check FILE`, `python -m trackably certify TABLE --system FILE`."""

import signal

if __name__ == "__main__" and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # background jobs ignore it
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends the imports below without a traceback

import argparse
import logging
import sys
from pathlib import Path

from trackably.checker.__main__ import INTERRUPTED, UNUSABLE, report
from trackably.checking import check
from trackably.errors import InputError
from trackably.files import write_text
from trackably.progress import LOG
from trackably.theorem import SILENT, theorem

_CODES = """Exit codes: 0 FILE is proved, and what it proves is printed; 1 a step of the proof fails; 2 FILE cannot be
used; 3 not decided within N seconds; 4 FILE is a valid counterexample: its reference is not trackable; 5 FILE
is a valid contradiction: no reference keeps its bounds and values; 130 interrupted. With several files, the exit
code is the largest of their codes: 0 only if all are proved.
"""

_ANSWERS = """Exit codes: 0 proved; 1 refuted: the time, the bound and the amount are printed; 2 a file cannot be
used, or does not fit; 3 neither proved nor refuted: what a proof lacks is printed; 130 interrupted.
"""
_INTERPOLATIONS = ("linear", "cubic", "quintic")


def main(arguments: list[str]) -> int:
    """Run a command and return its exit code; `--help` lists the codes."""
    parser = argparse.ArgumentParser(
        prog="python -m trackably", description="Check proofs, and certify trajectories that others made."
    )
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
    certifying = commands.add_parser("certify", help="prove or refute a trajectory that is given", epilog=_ANSWERS)
    _certify_arguments(certifying)
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
        if given.command == "certify":
            from trackably.given.command import run  # noqa: PLC0415  loads all modules that search for proofs

            return run(given)
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


def _certify_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command `certify`."""
    parser.add_argument("table", type=Path, metavar="TABLE", help="CSV: steps or times [s], states and inputs by name")
    parser.add_argument(
        "--system", type=Path, metavar="FILE", required=True, help="YAML or JSON: system, state_set, input_set"
    )
    parser.add_argument(
        "--interpolation",
        choices=_INTERPOLATIONS,
        help="join the rows by splines, and prove all times between them; by default, the rows alone are proved, as "
        "states and inputs at the steps",
    )
    parser.add_argument(
        "--claim",
        choices=("all_times", "all_phases"),
        help="the times to prove; by default, from the first row to the last",
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        default=1e-9,
        metavar="X",
        help="if the rows alone are proved: the largest difference of a state from what the system predicts (1e-9)",
    )
    parser.add_argument(
        "--decimal", choices=(".", ","), default=".", metavar="MARK", help="the decimal mark in TABLE: . or , (a point)"
    )
    parser.add_argument("--time", metavar="NAME", help="the column of times [s] in TABLE, if not k, step, t or time")
    parser.add_argument("--save", type=Path, metavar="OUT", help="write certificate or counterexample, for `check`")


def _state(file: Path, output: Path, emulated: bool) -> int:
    stated = theorem(file, emulated)
    write_text(output, stated.text)
    print(f"wrote {output}. With Coq's files of `theorem/`, which `make theorem` compiles, this proves it:")
    print(f"  coqc -Q theorem Trackably {output}\nIts statement has the SHA-256 {stated.fingerprint}. {SILENT}")
    return 0


if __name__ == "__main__":
    logging.basicConfig(format="%(message)s")  # log messages go to stderr, as progress bars do
    LOG.setLevel(logging.INFO)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        code = main(sys.argv[1:])
    except KeyboardInterrupt:
        code = INTERRUPTED
    sys.exit(code)
