"""What certificates say of evaluation in float64, beside arithmetic with intervals."""

from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from trackably.arrays import Array
from trackably.certificates.draft import Draft
from trackably.checker.intervals import exactly
from trackably.exports.proved import Proved


def require_within_certified_errors(proved: Proved, times: Iterable[Fraction], values: Array) -> None:
    """Fail where a value is farther from the exact one, in intervals, than the certificate says."""
    draft, names = Draft.of(proved.reference, 100.0, np.zeros(1)), proved.reference.plant.names
    enclosed = [(i, name) for i, name in enumerate(names) if name in draft.errors]
    assert enclosed
    for t, row in zip(times, values.tolist(), strict=True):
        for i, name in enclosed:
            error = exactly(proved.certificate.evaluation_error[name])
            assert abs(draft.value(name, t) - exactly(row[i])) <= error, (name, t)
