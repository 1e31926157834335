"""Find the rows that are out of order."""

from bisect import bisect_right
from collections.abc import Sequence
from decimal import Decimal


def out_of_order(stamps: Sequence[Decimal]) -> list[int]:
    """Return the fewest rows whose removal leaves non-decreasing stamps; of two swapped rows, the later one.

    These are not simply the rows earlier than their predecessor: after one stamp far in the future, that would be all
    others. The rest is a longest non-decreasing subsequence, found by patience sorting from the end in O(n log n).
    """
    smallest: list[Decimal] = []  # [k]: over all chains of k + 1 rows found so far, the latest first stamp, negated
    starts: list[int] = []  # [k]: the row of that stamp
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
