"""Which rows stand out of order."""

from bisect import bisect_right
from collections.abc import Sequence
from decimal import Decimal


def out_of_order(stamps: Sequence[Decimal]) -> list[int]:
    """The fewest rows without which the stamps never decrease; of two that are swapped, the later one.

    Not the rows that lie before their predecessor: behind one stamp far in the future these would be all the others.
    What remains is a longest non-decreasing subsequence, found by patience sorting from the end in n log n steps.
    """
    smallest: list[Decimal] = []  # [k]: of all chains of k + 1 rows found so far, the best start of one, negated
    starts: list[int] = []  # [k]: its row
    follower: dict[int, int | None] = {}
    for row in range(len(stamps) - 1, -1, -1):
        key = -stamps[row]
        k = bisect_right(smallest, key)
        smallest[k : k + 1] = [key]
        starts[k : k + 1] = [row]
        follower[row] = starts[k - 1] if k else None
    kept = set()
    at = starts[-1] if starts else None
    while at is not None:
        kept.add(at)
        at = follower[at]
    return [row for row in range(len(stamps)) if row not in kept]
