"""Every check ends: what is too large is refused in a sentence, and a time that is given is kept."""

import re

import pytest

from tests.trackably.checker.edges import hostile
from tests.trackably.checker.files import file_of
from tests.trackably.checker.tight import data_of
from trackably import checker
from trackably.checker import Contradicted, Failed, NotACertificate, Proved, Undecided, check, limits


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (hostile.deep(limits.DEPTH), "must not be nested more than 100 deep"),
        (hostile.deep(900), "must not be nested more than 100 deep"),
        (hostile.long(limits.PARTS), "must have no more than 30000 operations, names and numbers"),
        (hostile.long(3 * limits.PARTS), "all texts of the file together must have no more than 500000 characters"),
    ],
)
def test_formulas_are_short(data: dict, reason: str) -> None:
    verdict = check(data)
    assert isinstance(verdict, NotACertificate)
    assert reason in verdict.reason


def test_the_theorem_names_every_limit() -> None:
    for name, number in vars(limits).items():
        if isinstance(number, int):
            wanted = f"{number // 10**6} MB" if name in ("BYTES", "MEMORY") else f"{number:,}"
            assert re.search(rf"\b{wanted}\b", checker.__doc__), name


def test_a_formula_that_doubles_with_each_state_is_checked_in_the_size_it_has() -> None:
    """Solved for its inputs, it has 2^40 parts if they are counted as often as they are written."""
    verdict = check(hostile.chain(40))
    assert isinstance(verdict, Failed | Undecided)
    verdict = check(hostile.chain(3))
    assert isinstance(verdict, Failed)
    assert not verdict.reason.startswith("system")


def test_a_time_that_is_given_is_kept() -> None:
    for data in (hostile.tower(40), data_of("window"), data_of("instants")):
        assert check(data, seconds=1e-9) == Undecided("not decided within 1e-09 s")
    assert isinstance(check(hostile.tower(40), seconds=1), Undecided | Failed)
    assert isinstance(check(data_of("instants"), seconds=600), Proved)


def test_long_integers_and_many_rows_take_little_time() -> None:
    pieces = file_of("end")
    signal = pieces["reference"]["signals"][0]
    signal |= {"breakpoints": [1e-300, *range(1, 1001)], "coefficients": [[1.0] * 51] * 1000}
    assert check(pieces, seconds=60).reason.startswith("not decided: exact arithmetic would need whole numbers")
    many = file_of("contradiction")
    inputs, proof = many["plant"]["input_set"], many["proof"]
    for name in ("rows", "lower", "upper"):
        inputs[name] += 1500 * inputs[name][-1:]
    proof["inputs"] = [[*row, *1500 * [0.0]] for row in proof["inputs"]]
    assert isinstance(check(many, seconds=60), Contradicted)


def test_progress_counts_boxes_and_instants() -> None:
    for kind in ("window", "instants"):
        told: list[tuple[int, int]] = []
        assert isinstance(check(data_of(kind), report=lambda *far: told.append(far)), Proved)  # noqa: B023
        assert told == [(i, len(told)) for i in range(len(told))] != []
