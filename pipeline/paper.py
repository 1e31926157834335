"""Numbers printed in the paper, from data/paper: never typed a second time."""

import csv
from pathlib import Path

_PRINTED = Path("data/paper/printed_numbers.csv")


def printed_numbers(experiment: str) -> dict[str, float]:
    """Quantity → printed value."""
    with _PRINTED.open(newline="", encoding="utf-8") as file:
        return {row["quantity"]: float(row["value"]) for row in csv.DictReader(file) if row["experiment"] == experiment}
