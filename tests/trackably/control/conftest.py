"""References that are learned once and used by many tests."""

from dataclasses import dataclass

import pytest

from pipeline.control import interpolated
from tests.trackably.control import instances
from trackably.certificates.certified import Certified, learn_certified
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.search import best_solution
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class Example:
    learning: instances.Learning
    learned: Certified
    unconstrained: Reference
    interpolated: Reference

    @property
    def certified(self) -> Reference:
        return self.learned.reference


def _example(learning: instances.Learning) -> Example:
    learned = learn_certified(learning.samples, learning.prior, learning.plant, learning.space)
    plain = best_solution(ConstrainedProblem(learning.samples, learning.prior, learning.space))
    unconstrained = Reference(plain.posterior.signals, learning.plant)
    return Example(learning, learned, unconstrained, interpolated(learning.samples, learning.plant))


@pytest.fixture(scope="session")
def example1() -> Example:
    return _example(instances.example1())


@pytest.fixture(scope="session")
def example2() -> Example:
    return _example(instances.example2())


@pytest.fixture(scope="session", params=["example1", "example2"])
def example(request) -> Example:
    return request.getfixturevalue(request.param)
