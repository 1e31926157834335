"""Joint trajectories in the checker: it accepts what rational arithmetic shows, and nothing beside it."""

from itertools import product
from typing import Any

import numpy as np
import pytest

from tests.trackably.checker.changes import changed, with_changes
from tests.trackably.joints.trajectories import extreme, mirrored, random_content, with_limit
from trackably.checker import Failed, Proved, check
from trackably.checker.joints import BROKEN, not_kept, read_joints
from trackably.checker.polynomials import value_of_polynomial

SEEDS = range(12)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("order", range(4))
def test_a_limit_is_proved_up_to_the_extreme_and_not_beyond(seed: int, order: int) -> None:
    """The largest value of each derivative is known in many digits: 1e-9 of it decide."""
    content = random_content(np.random.default_rng(seed), order)
    most = extreme(content, 0, order)
    for part, wanted in ((1e-9, Proved), (-1e-9, Failed)):
        limited = with_limit(content, order, float(most) + part * float(abs(most)))
        assert isinstance(check(limited), wanted)
        assert isinstance(check(mirrored(limited)), wanted)


@pytest.mark.parametrize("seed", SEEDS)
def test_what_is_not_kept_is_what_rational_numbers_show(seed: int) -> None:
    """Jumps are compared one by one; a limit that is kept is kept at nine times of its piece."""
    rng = np.random.default_rng(seed)
    content = random_content(rng, 3, joints=3)
    for joint in content["joints"]:
        joint["limits"] = [[-x, x] for x in rng.uniform(0.2, 1.2, 4) * [1, 3, 30, 500]]
    content["jumps"] = [float(10.0 ** rng.integers(-17, -12)) for _ in range(3)]
    content["trajectory"]["beyond"] = ("rest", "end")[seed % 2]
    of = read_joints(content)
    found = set(not_kept(of))
    for j, r, i in product(range(3), range(4), range(of.pieces)):
        polynomial, width = of.polynomial(j, i, r)
        reached = max(abs(value_of_polynomial(polynomial, width * k / 8)) for k in range(9))
        assert reached <= content["joints"][j]["limits"][r][1] or (False, j, r, i) in found
        if r < 3 and i in of.inner:
            assert (abs(of.jump(j, r, i)) > of.jumps[r]) == ((True, j, r, i) in found)


def touching() -> dict[str, Any]:
    """q = 2 t − t² from 0 to 2: its largest value is exactly 1, and its velocity from 2 to −2."""
    return {
        "format": "trackably joint trajectory",
        "version": 1,
        "joints": [{"name": "elbow", "limits": [[0.0, 1.0], [-2.0, 2.0]]}],
        "trajectory": {"breakpoints": [0.0, 2.0], "coefficients": [[[0.0, 2.0, -1.0]]], "beyond": "end"},
        "jumps": [1e-12],
    }


def broken() -> dict[str, Any]:
    """Return a counterexample: the velocity of `touching` is −2 at the end, beyond a limit of −1.5."""
    entry = {"joint": 0, "order": 1, "piece": 0, "since": 2.0, "violation": 0.5}
    return changed(touching() | {"format": BROKEN, "broken": [entry]}, "joints.0.limits.1.0", -1.5)


def jumping(allowed: float = 2e-9) -> dict[str, Any]:
    """Return q = t with a jump by 1e-9 at 1 s."""
    curve = {"breakpoints": [0.0, 1.0, 2.0], "coefficients": [[[0.0, 1.0], [1.0 + 1e-9, 1.0]]], "beyond": "end"}
    return changed(touching(), "joints.0.limits.0.1", 3.0) | {"trajectory": curve, "jumps": [allowed]}


JOINTS = {
    "joints": touching,
    "joints with an acceleration": lambda: (
        changed(touching(), "joints.0.limits", [None, None, [-2, 2]]) | {"jumps": [1e-9, 1e-9]}
    ),
    "joints that rise": lambda: with_changes(
        touching(), {"joints.0.limits": [None, [1, 2]], "trajectory.coefficients": [[[0.0, 1.5]]]}
    ),
    "joints that jump": jumping,
    "joints that jump and are bounded in place": lambda: changed(jumping(1e-12), "joints.0.limits.1", None),
    "broken joints": broken,
    "joints broken by a jump": lambda: (
        jumping(1e-12) | {"format": BROKEN, "broken": [{"joint": 0, "order": 0, "jump": 1, "violation": 9e-10}]}
    ),
}
"""Files that are accepted."""


def test_the_fingerprint_is_that_of_the_numbers() -> None:
    one = read_joints(touching()).fingerprint
    for same in ([[[0, 2, -1]]], [[[-0.0, 2.0, -1.0]]]):
        assert read_joints(changed(touching(), "trajectory.coefficients", same)).fingerprint == one
    for path, other in (("trajectory.beyond", "rest"), ("trajectory.breakpoints", [0.0, 2.5]), ("joints.0.name", "x")):
        assert read_joints(changed(touching(), path, other)).fingerprint != one
