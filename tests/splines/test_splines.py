"""Nothing false, and nothing undecided that float64 can tell: two random splines of each family, at all margins."""

from tests.splines.trials import Counts, try_one


def test_a_few_random_splines():
    counts: dict[str, Counts] = {}
    for number in range(0, 42, 3):
        try_one(counts, 5, number)
    assert len(counts) == 7
    assert [what for found in counts.values() for what in (*found.false, *found.undecided)] == []
    assert sum(found.certificates for found in counts.values()) > 4
    assert sum(found.counterexamples for found in counts.values()) > 8
