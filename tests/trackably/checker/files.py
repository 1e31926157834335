"""Files of every kind that the checker reads, to be checked, changed and refused."""

import json
from collections.abc import Callable
from functools import cache, partial
from typing import Any

from tests.trackably.certificates.nonlinear.instances import proved
from tests.trackably.certificates.test_moving import CERTIFIED, certified
from tests.trackably.checker.edges.test_counterexamples import FOUND, counterexample
from tests.trackably.checker.instances import scalar_certificate
from tests.trackably.checker.pieces import instances as pieces
from tests.trackably.checker.redundant import in_the_plane, learned
from tests.trackably.checker.robust.instances import KINDS as ROBUST
from tests.trackably.checker.robust.instances import robust_data
from tests.trackably.checker.robust.redundant import two_pushers
from tests.trackably.checker.test_contradiction import multipliers, tank
from tests.trackably.checker.test_joints import JOINTS
from tests.trackably.checker.tight import VALID, data_of
from trackably.certificates.form import encode_certificate

CERTIFICATES: dict[str, Callable[[], dict]] = {
    "scalar": scalar_certificate,
    **{kind: partial(data_of, kind) for kind in VALID},
    "tank": lambda: encode_certificate(proved("tank")),
    "redundant inputs": lambda: encode_certificate(learned().certificate),
    "redundant inputs in the plane": lambda: encode_certificate(in_the_plane()),
    **{kind: partial(robust_data, kind) for kind in ROBUST},
    "two pushers": two_pushers,
    **{f"moving bounds, {claim}": partial(certified, claim) for claim in CERTIFIED},
    **{beyond: partial(pieces.certificate, beyond) for beyond in ("rest", "period", "end")},
}
FILES: dict[str, Callable[[], dict]] = {
    **CERTIFICATES,
    **{f"counterexample, {kind}": partial(counterexample, kind) for kind in FOUND},
    "contradiction": multipliers,
    "contradiction by boxes": lambda: tank(2, 0.7),
    **JOINTS,
}


@cache
def _text(kind: str) -> str:
    return json.dumps(FILES[kind](), allow_nan=False)


def file_of(kind: str) -> dict[str, Any]:
    """Return a file's content of its own, as it is read."""
    found: dict[str, Any] = json.loads(_text(kind))
    return found
