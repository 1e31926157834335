"""The arguments of `python -m trackably certify`, in a module that loads nothing else."""

from argparse import ArgumentParser
from pathlib import Path

INTERPOLATIONS = ("linear", "cubic", "quintic", "pchip", "akima")
CODES = """Exit codes: 0 proved; 1 refuted: the time, the bound and the amount are printed; 2 a file cannot be used, or
does not fit; 3 neither proved nor refuted: what a proof lacks is printed; 130 interrupted.
"""


def add_arguments(parser: ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.add_argument("table", type=Path, metavar="TABLE", help="CSV: k or t, then states and inputs by name")
    parser.add_argument(
        "--system", type=Path, metavar="FILE", required=True, help="YAML or JSON: system, state_set, input_set"
    )
    parser.add_argument(
        "--interpolation",
        choices=INTERPOLATIONS,
        help="prove all times between the rows; left out, the rows alone, as states and inputs at the steps",
    )
    parser.add_argument("--claim", choices=("all_times", "all_phases"), help="left out, from the first row to the last")
    parser.add_argument(
        "--tolerance", type=float, default=1e-9, metavar="X", help="of the next state, where the rows alone are proved"
    )
    parser.add_argument("--save", type=Path, metavar="OUT", help="write certificate or counterexample, for `check`")
