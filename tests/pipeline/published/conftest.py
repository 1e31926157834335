"""What is learned once and asked about often."""

import pytest

from pipeline.published.algorithm1 import AS_PUBLISHED, SOUND, Run, algorithm1
from tests.pipeline.published import example1
from trackably.learning.problem import Solution
from trackably.learning.search import best_solution


@pytest.fixture(scope="session")
def unconstrained() -> Solution:
    return best_solution(example1.problem())


def _run(reading, first_step: int = 70) -> Run:
    return algorithm1((example1.SAMPLES,), example1.PRIOR, example1.SYSTEM, example1.SPACE, reading, first_step, 150)


@pytest.fixture(scope="session")
def as_published() -> Run:
    return _run(AS_PUBLISHED)


@pytest.fixture(scope="session")
def sound() -> Run:
    return _run(SOUND, 120)


@pytest.fixture(scope="session", params=["as_published", "sound"])
def run(request) -> Run:
    return request.getfixturevalue(request.param)
