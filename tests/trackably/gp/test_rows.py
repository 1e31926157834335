"""Rows as data: sums of values at times, their transpose, and how they are put below each other."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from trackably.gp.rows import Rows, Terms

COUNT = 6


def random_terms(seed: int, count: int = COUNT) -> Terms:
    """Some rows have several terms, some none; in no order."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(0, 15)) if count else 0
    return Terms(rng.uniform(-1, 3, size), rng.normal(size=size), rng.integers(0, max(count, 1), size))


def random_rows(seed: int, count: int = COUNT) -> Rows:
    return Rows(
        np.random.default_rng(seed).normal(size=count), tuple(random_terms(2 * seed + c, count) for c in (0, 1))
    )


def plainly(rows: Rows, signals) -> np.ndarray:
    values = rows.offsets.copy()
    for g, terms in zip(signals, rows.terms, strict=True):
        for t, w, a in zip(terms.times, terms.weights, terms.of_row, strict=True):
            values[a] += w * g(t)
    return values


@given(st.integers(0, 10**6))
def test_values_are_weighted_sums(seed):
    rows = random_rows(seed)
    np.testing.assert_allclose(rows.values((np.sin, np.exp)), plainly(rows, (np.sin, np.exp)), rtol=1e-13, atol=1e-13)


@given(st.integers(0, 10**6), st.integers(1, 3))
def test_spreading_is_the_transpose_of_summing(seed, columns):
    terms, rng = random_terms(seed), np.random.default_rng(seed)
    values, multipliers = rng.normal(size=(len(terms.times), columns)), rng.normal(size=COUNT)
    summed = terms.summed(values, COUNT)
    assert summed.shape == (COUNT, columns)
    np.testing.assert_allclose(multipliers @ summed, terms.spread(multipliers) @ values, atol=1e-13)


@given(st.integers(0, 10**6))
def test_rows_below_each_other_keep_their_values(seed):
    parts = [random_rows(seed + i, count) for i, count in enumerate((2, 0, 5))]
    joined = Rows.joined(parts, 2)
    assert len(joined) == 7
    each = np.concatenate([part.values((np.sin, np.cos)) for part in parts])
    np.testing.assert_array_equal(joined.values((np.sin, np.cos)), each)
