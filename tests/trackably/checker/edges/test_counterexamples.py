"""Counterexamples as files: a time that is claimed, at which a bound is broken; the checker verifies both."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from tests.trackably.certificates.decoded import as_read
from tests.trackably.certificates.nonlinear.instances import tight
from tests.trackably.certificates.test_prove import reference
from tests.trackably.checker.changes import with_changes, without
from tests.trackably.checker.redundant import learned
from trackably import NotTrackableError
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import Outcome, prove
from trackably.checker import Failed, Refuted, check
from trackably.checker.certificate import Instants, Window
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference


def refuted(found: Outcome) -> dict:
    """As it is read from a file."""
    assert isinstance(found, Counterexample), found.explanation
    return as_read(found)


def narrowed(given: Reference, **bounds: Polytope) -> Reference:
    return Reference(given.signals, replace(given.plant, **bounds))


BROKEN = narrowed(reference(SquaredExponential(1.0, 0.3)), state_set=Polytope.box([-0.3], [2.0]))


PERIODIC = narrowed(reference(Periodic(1.0, 1.0, 0.73)), state_set=Polytope.box([-0.1], [2.0]))
FOUND: dict[str, Callable[[], Outcome]] = {
    "all_times": lambda: prove(BROKEN),
    "window": lambda: prove(BROKEN, Window(-0.3, 1.3)),
    "instants": lambda: prove(BROKEN, Instants()),
    "all_phases": lambda: prove(PERIODIC),
    "instants of a periodic kernel": lambda: prove(PERIODIC, Instants()),
    "redundant inputs": lambda: prove(narrowed(learned().reference, input_set=Polytope.box([-0.5, -0.1], [0.5, 0.1]))),
    "nonlinear": lambda: prove(tight("tank", room=-1e-3)),
}
"""One of each claim, of redundant inputs and of a nonlinear system."""


@cache
def counterexample(kind: str) -> dict:
    return refuted(FOUND[kind]())


def test_redundant_inputs_are_judged_by_what_the_set_demands_not_by_the_rows_of_the_file() -> None:
    """Narrower rows prove nothing."""
    data = counterexample("redundant inputs")
    narrow = {**data, "attainable": [{**row, "lower": -1e-3, "upper": 1e-3} for row in data["attainable"]]}
    ends = {"reference.plant.input_set.lower": [-9.0, -9.0], "reference.plant.input_set.upper": [9.0, 9.0]}
    assert isinstance(check(narrow), Refuted)
    assert isinstance(check(with_changes(narrow, ends)), Failed)


def test_a_reference_that_is_refused_leaves_its_counterexample_as_a_file(tmp_path) -> None:
    NotTrackableError(prove(BROKEN)).save_counterexample(tmp_path / "why.json")
    assert isinstance(check(json.loads((tmp_path / "why.json").read_text())), Refuted)


def test_a_redundant_input_that_breaks_its_bound_alone_refutes_nothing() -> None:
    """Another input of the same effect may be in U: also where the file holds no attainable rows."""
    few = narrowed(learned().reference, input_set=Polytope.box([-9.0, -0.1], [9.0, 0.1]))
    data = refuted(prove(narrowed(few, state_set=Polytope.box([-0.01], [0.01]))))
    data = {**without(data, "attainable"), "quantity": "u2"}
    times, second = np.linspace(0, 8, 801), few.plant.flatness.inputs[1]
    largest = float(times[np.argmax(second(few.signals, times))])
    assert second(few.signals, np.array(largest)) > 0.12
    verdict = check({**data, "at": {"time": largest}, "violation": 0.01})
    assert isinstance(verdict, Failed), verdict
    assert "not shown to follow" in verdict.reason or "not shown to be outside" in verdict.reason
