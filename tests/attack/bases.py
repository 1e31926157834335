"""Certificates and counterexamples to change, and how to find out whether what they say is true."""

import json
from collections.abc import Callable
from dataclasses import dataclass

from tests.attack.truth import input_exists, is_broken, is_kept, is_kept_by_formulas
from tests.trackably.certificates.decoded import as_read
from tests.trackably.certificates.nonlinear.instances import proved
from tests.trackably.checker.edges.test_before_zero import SHORT, certificate
from tests.trackably.checker.edges.test_counterexamples import FOUND, counterexample
from tests.trackably.checker.pieces import instances as pieces
from tests.trackably.checker.redundant import in_the_plane, learned
from tests.trackably.checker.tight import VALID
from trackably.certificates import cover, draft, prove
from trackably.certificates.form import encode_certificate


@dataclass(frozen=True)
class Base:
    """A valid file of a `family`, and whether a changed one is true."""

    family: str
    data: dict
    is_true: Callable[[dict], bool]


def bases() -> list[Base]:
    """Return all bases. Taylor polynomials are short, so that thousands can be checked."""
    cover.TERMS = draft.TERMS = prove.TERMS = 8
    found = [Base("bounds, boxes, numbers", encode_certificate(make()), is_kept) for make in VALID.values()]
    found += [
        Base("windows before time zero", encode_certificate(certificate(kernel, 3)), is_kept)
        for kernel in SHORT.values()
    ]
    found += [Base("pieces", pieces.certificate(beyond), is_kept) for beyond in ("rest", "period", "end")]
    found.append(Base("formulas", as_read(proved("tank")), is_kept_by_formulas))
    for redundant in (in_the_plane(), learned().certificate):
        found.append(Base("redundant inputs", as_read(redundant), lambda data: is_kept(data) and input_exists(data)))
    found += [
        Base("counterexamples", counterexample(kind), is_broken)
        for kind in FOUND
        if kind not in ("redundant inputs", "nonlinear")
    ]
    return [Base(base.family, json.loads(json.dumps(base.data)), base.is_true) for base in found]
