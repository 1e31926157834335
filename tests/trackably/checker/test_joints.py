"""Joint trajectories in the checker: it accepts what rational arithmetic shows, and nothing beside it."""

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.trackably.joints.trajectories import extreme, mirrored, random_content, with_limit
from trackably.checker import Failed, NotACertificate, Proved, Refuted, check
from trackably.checker.floats.joints import undecided
from trackably.checker.joints import BROKEN, check_joints, everything, read_joints

SEEDS = range(12)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("order", range(4))
def test_a_limit_is_proved_up_to_the_extreme_and_not_beyond(seed: int, order: int) -> None:
    """The largest value of each derivative is known in many digits: 1e-9 of it decide, in both arithmetics."""
    content = random_content(np.random.default_rng(seed), order)
    most = extreme(content, 0, order)
    for part, wanted in ((1e-9, Proved), (-1e-9, Failed)):
        limited = with_limit(content, order, float(most) + part * float(abs(most)))
        for exact in (False, True):
            assert isinstance(check(limited, exact=exact), wanted)
            assert isinstance(check(mirrored(limited), exact=exact), wanted)


@pytest.mark.parametrize("seed", SEEDS)
def test_float64_keeps_nothing_that_rational_numbers_do_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    content = random_content(rng, 3, joints=3)
    for joint in content["joints"]:
        joint["limits"] = [[-x, x] for x in rng.uniform(0.2, 1.2, 4) * [1, 3, 30, 500]]
    content["jumps"] = [float(10.0 ** rng.integers(-17, -12)) for _ in range(3)]
    trajectory = read_joints(content)
    limits, jumps = map(set, undecided(trajectory))
    every, all_jumps = map(set, everything(trajectory))
    assert len(every - limits) > 0
    assert check_joints(trajectory, lambda _: (every - limits, all_jumps - jumps)) is None


def touching() -> dict[str, Any]:
    """q = 2 t − t² from 0 to 2: its largest value is exactly 1, and its velocity from 2 to −2."""
    return {
        "format": "trackably joint trajectory",
        "version": 1,
        "joints": [{"name": "elbow", "limits": [[0.0, 1.0], [-2.0, 2.0]]}],
        "trajectory": {"breakpoints": [0.0, 2.0], "coefficients": [[[0.0, 2.0, -1.0]]], "beyond": "end"},
        "jumps": [1e-12],
    }


def changed(change: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    content = copy.deepcopy(touching())
    change(content)
    return content


def limits(*given: Any) -> Callable[[dict[str, Any]], object]:
    return lambda content: content["joints"][0].update(limits=[*given])


def trajectory(**given: Any) -> Callable[[dict[str, Any]], object]:
    return lambda content: content["trajectory"].update(given)


def broken(**given: Any) -> Callable[[dict[str, Any]], object]:
    def change(content: dict[str, Any]) -> None:
        entry = {"joint": 0, "order": 1, "piece": 0, "since": 2.0, "violation": 0.5, **given}
        content["joints"][0]["limits"] = [None, [-1.5, 2.0]]
        content.update(format=BROKEN, broken=[{k: v for k, v in entry.items() if v is not None}])

    return change


def jump(by: float) -> Callable[[dict[str, Any]], object]:
    return broken(piece=None, since=None, jump=1, order=0, violation=by)


TWO = {"breakpoints": [0.0, 1.0, 2.0], "coefficients": [[[0.0, 1.0], [1.0 + 1e-9, 1.0]]]}
VERDICTS: dict[str, tuple[Callable[[dict[str, Any]], object], type]] = {
    "touching": (lambda _: None, Proved),
    "the former name": (lambda content: content.update(format="trackable joint trajectory"), Proved),
    "an upper limit one digit lower": (limits([0.0, float(np.nextafter(1, 0))], None), Failed),
    "a velocity one digit lower": (limits(None, [float(np.nextafter(-2, 0)), 2.0]), Failed),
    "at rest with a velocity, where this may jump": (trajectory(beyond="rest"), Proved),
    "at rest with a velocity": (
        lambda c: (limits(None, None, [-2, 2])(c), trajectory(beyond="rest")(c), c.update(jumps=[1e-9, 1e-9])),
        Failed,
    ),
    "at rest where it must move": (
        lambda c: (limits(None, [1, 2])(c), trajectory(beyond="rest", coefficients=[[[0.0, 1.5]]])(c)),
        Failed,
    ),
    "moving where it must move": (
        lambda c: (limits(None, [1, 2])(c), trajectory(coefficients=[[[0.0, 1.5]]])(c)),
        Proved,
    ),
    "at rest with a position alone": (
        lambda c: (limits([0.0, 1.0])(c), trajectory(beyond="rest")(c), c.update(jumps=[])),
        Proved,
    ),
    "a jump that is too large": (lambda c: (trajectory(**TWO)(c), limits(None, [0, 2])(c)), Failed),
    "a jump that is allowed": (
        lambda c: (trajectory(**TWO)(c), limits(None, [0, 2])(c), c.update(jumps=[2e-9])),
        Proved,
    ),
    "a jump that is a little too large": (
        lambda c: (trajectory(**TWO)(c), limits(None, [0, 2])(c), c.update(jumps=[9.9e-10])),
        Failed,
    ),
    "a jump of what has no further limits": (
        lambda c: (trajectory(**TWO)(c), limits([0, 3], None)(c)),
        Proved,
    ),
    "no jump is negative": (lambda c: c.update(jumps=[-1.0]), NotACertificate),
    "limits in the wrong order": (limits([1.0, 0.0], None), NotACertificate),
    "three ends": (limits([0.0, 1.0, 2.0], None), NotACertificate),
    "no limit": (limits(None, None), NotACertificate),
    "more limits than orders": (limits(None, None, [0.0, 1.0]), NotACertificate),
    "times that do not increase": (trajectory(breakpoints=[0.0, 0.0]), NotACertificate),
    "a piece too few": (trajectory(breakpoints=[0.0, 1.0, 2.0]), NotACertificate),
    "whole numbers": (trajectory(coefficients=[[[0, 2, -1]]]), Proved),
    "two joints of one name": (
        lambda c: (c["joints"].append(c["joints"][0]), trajectory(coefficients=[[[0.0]], [[0.0]]])(c)),
        NotACertificate,
    ),
    "another version": (lambda c: c.update(version=2), NotACertificate),
    "what is broken": (broken(), Refuted),
    "broken by less than is said": (broken(violation=0.51), Failed),
    "broken beyond the end": (broken(since=2.1), Failed),
    "broken on no piece": (broken(piece=1), Failed),
    "broken by no joint": (broken(joint=1), Failed),
    "broken without a limit": (broken(order=0), Failed),
    "a jump where there is none": (broken(piece=None, since=None, jump=1, order=0), Failed),
    "a jump": (lambda c: (jump(9e-10)(c), trajectory(**TWO)(c)), Refuted),
    "a jump that does not count": (
        lambda c: (jump(9e-10)(c), trajectory(**TWO)(c), limits([0, 3], None)(c)),
        Failed,
    ),
    "a jump by more": (lambda c: (jump(2e-9)(c), trajectory(**TWO)(c)), Failed),
    "a violation of zero": (broken(violation=0.0), NotACertificate),
}  # fmt: skip


@pytest.mark.parametrize("name", VERDICTS)
def test_a_file_is_what_it_says(name: str) -> None:
    change, wanted = VERDICTS[name]
    content = changed(change)
    assert type(check(content)) is wanted
    assert type(check(content, exact=True)) is wanted


def test_the_fingerprint_is_that_of_the_numbers() -> None:
    one = read_joints(touching()).fingerprint
    assert one == read_joints(changed(trajectory(coefficients=[[[0, 2, -1]]]))).fingerprint
    assert one == read_joints(changed(trajectory(coefficients=[[[-0.0, 2.0, -1.0]]]))).fingerprint
    others = [trajectory(beyond="rest"), trajectory(breakpoints=[0.0, 2.5]), lambda c: c["joints"][0].update(name="x")]
    assert one not in {read_joints(changed(change)).fingerprint for change in others}
