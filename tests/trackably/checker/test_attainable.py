"""Certificates of systems with redundant inputs are refused where a bound leaves too much."""

from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

from tests.trackably.gp.instances import over
from tests.trackably.systems.redundant_instances import CASES
from trackably.checker.redundancy import why_not_attainable
from trackably.checker.subject import Row
from trackably.systems.allocation import Allocation


def row_of(row, lower: float, upper: float) -> Row:
    return Row(tuple(map(Fraction, row)), lower, upper)


@over(CASES, "case")
def test_both_implementations_find_the_same_rows(case):
    """The checker wants every row that the prover bounds, to the last bit, and no more."""
    system, wanted = case
    attainable = tuple(row_of(r, b.lower, b.upper) for r, b in Allocation.of(system, wanted).attainable)
    rows = tuple(row_of(r.tolist(), b.lower, b.upper) for r, b in wanted.intervals)
    checked = SimpleNamespace(inputs=system.inputs, B=system.B.tolist())
    assert why_not_attainable(checked, rows, attainable) is None
    for i, bound in enumerate(attainable):
        others = attainable[:i] + attainable[i + 1 :]
        wider = (
            replace(bound, high=bound.upper * (1 + 1e-15) + 1e-15),
            replace(bound, low=bound.lower - 1e-12),
        )
        for one in wider:
            assert why_not_attainable(checked, rows, (*others, one)) is not None
        assert why_not_attainable(checked, rows, others) is not None
