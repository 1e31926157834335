"""The library's command line: `python -m trackable check FILE`."""

import argparse
import sys
from pathlib import Path

from trackable.checking import check_file
from trackable.errors import InputError, NoReferenceError

_FAILED, _UNUSABLE = 1, 2


def main(arguments: list[str]) -> int:
    """Run a command and return its exit code: 0 done, 1 nothing is proved, 2 something handed in is not usable."""
    parser = argparse.ArgumentParser(prog="python -m trackable", description="What needs no pipeline.")
    commands = parser.add_subparsers(dest="command", required=True)
    check = commands.add_parser("check", help="check a certificate, independently of what found it")
    check.add_argument("file", type=Path, metavar="FILE", help="a certificate, as `save_certificate` writes it")
    try:
        print(check_file(parser.parse_args(arguments).file))
    except NoReferenceError as error:
        print(f"failed: {error}", file=sys.stderr)
        return _FAILED
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return _UNUSABLE
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
