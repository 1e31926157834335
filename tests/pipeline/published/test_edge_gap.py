"""The gap of the paper's Lemma 2: program (8) is kept, and a step from one interval into the next has no input."""

from itertools import pairwise

import numpy as np
import pytest

from pipeline.published.paper import EDGES, SYSTEM, reference_between_intervals
from pipeline.published.periodic import GrowthRates, on_intervals
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove
from trackably.gp.joint import JointPrior
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.learning.constraint import Constraint, closest
from trackably.learning.problem import ConstrainedProblem
from trackably.learning.search import best_solution
from trackably.learning.space import SearchSpace
from trackably.systems.reference import Reference

T = SYSTEM.sampling_time


@pytest.fixture(scope="module")
def reference():
    return reference_between_intervals()


@pytest.mark.parametrize(("start", "end"), [*pairwise(EDGES)])
def test_the_printed_program_is_kept(reference, start, end):
    """All rates of an interval with all states of the same interval, on a finer grid than the program's."""
    t = np.linspace(start, end, 2000)
    rates, states = T * reference.signals[0].derivative(t), -2 * reference.signals[0](t)
    assert np.max(rates) + np.max(states) < 1
    assert np.min(rates) + np.min(states) > -1


def test_the_input_leaves_its_set_by_two_percent_of_its_width(reference):
    assert isinstance(prove(reference), Counterexample)
    t = np.linspace(0.0, 1.0, 2000)
    excess = np.max(np.abs(reference.input_at(t))) - 1
    assert excess > 0.02 * 2


@pytest.mark.parametrize(("overlap", "keeps"), [(0.0, True), (T, False)])
def test_rates_that_hold_one_step_longer_see_it(reference, overlap, keeps):
    ((_, margins),) = closest([Constraint(SYSTEM.quantities[1], GrowthRates(SYSTEM, EDGES, overlap))], reference)
    assert np.all(margins >= 0) == keeps


def test_what_is_learned_with_them_is_proved_and_costs_more(reference):
    """The samples are the reference's own."""
    t = np.linspace(0.0, 1.9, 20)
    samples = (Samples(t, reference.signals[0](t)),)
    prior = JointPrior((Prior(Periodic(1.0, 1.5, 1.0).as_learned(("signal_std",)), 1e-3),))
    space = SearchSpace.around(samples, prior, starts=1)
    printed, sound = (
        best_solution(ConstrainedProblem(samples, prior, space, on_intervals(SYSTEM, 4, 4, overlap=overlap)))
        for overlap in (0.0, T)
    )
    assert sound.objective > printed.objective + 1
    assert isinstance(prove(Reference(sound.signals, SYSTEM)), Certificate)
