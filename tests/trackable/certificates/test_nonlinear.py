"""Certificates of nonlinear systems: found, checked, never given for what is false, and refused with a reason."""

import copy
import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from flint import arb
from mpmath import mp

from tests.trackable.systems.nonlinear_instances import INSTANCES, T_S, exactly, moving
from tests.trackable.systems.test_nonlinear import LINEAR, as_formulas
from trackable.certificates import cover, prove
from trackable.certificates.balls import models
from trackable.certificates.balls.arithmetic import ball_arithmetic, float_above, float_below
from trackable.certificates.balls.models import Enclosure
from trackable.certificates.certificate import Certificate
from trackable.certificates.certified import Certified, learn_certified
from trackable.certificates.enclosure import Box, best_radius, enclosure
from trackable.certificates.exact import exact_quantities
from trackable.certificates.limits import limits_beyond
from trackable.certificates.outcome import Counterexample, Unproved
from trackable.certificates.prove import prove as prove_always
from trackable.certificates.prove import prove_at_instants, prove_on_window
from trackable.certificates.rounding.references import evaluation_errors
from trackable.checker import Failed, NotACertificate, Proved, check
from trackable.gp.joint import JointPrior
from trackable.gp.kernels.periodic import Periodic
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.prior import Prior
from trackable.gp.samples import Samples
from trackable.learning.space import SearchSpace
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.nonlinear import Nonlinear
from trackable.systems.reference import Reference
from trackable.systems.sets.polytope import Polytope

END = 3.0
BOX = Polytope.box
WIDE = BOX([-99.0], [99.0])


def true_values(name: str, reference: Reference, times) -> dict[str, list]:
    """Of every state and input, in many digits."""
    found = [exactly(INSTANCES[name], reference, t) for t in times]
    return {q: [values[q] for values in found] for q in found[0]}


@pytest.mark.parametrize("name", INSTANCES)
def test_enclosures_hold_the_true_values(name):
    reference = moving(INSTANCES[name], seed=3)
    start, end = 0.4, 0.52
    times = np.linspace(start, end, 7)
    with mp.workdps(50):
        true = true_values(name, reference, times)
        for quantity in exact_quantities(reference):
            box = Box(start, end, best_radius(quantity.looks, start, end, 12))
            found = enclosure(quantity, box, 12)
            missed = mp.mpf(float_above(found.remainder))
            assert missed < 1e-6
            for t, value in zip(times, true[quantity.name], strict=True):
                with ball_arithmetic():
                    seen = found.coefficients((arb(t) - (arb(start) + arb(end)) / 2) * 2 / (arb(end) - arb(start)))
                assert abs(mp.mpf(seen.str(40, radius=False)) - value) <= missed + mp.mpf(10) ** -30


@pytest.mark.parametrize("name", INSTANCES)
def test_limits_hold_all_later_values_and_close_in_on_the_rest(name):
    reference = moving(INSTANCES[name], seed=3)
    reaches = []
    with mp.workdps(50):
        for start in (2.6, 3.2, 4.5):
            limits = limits_beyond(reference, arb(start))
            true = true_values(name, reference, np.linspace(start, start + 2, 12))
            for q, (centre, reach) in limits.items():
                assert reach.is_finite()
                low, high = float_below(centre - reach), float_above(centre + reach)
                assert all(low <= value <= high for value in true[q])
            reaches.append([float(reach) for _, reach in limits.values()])
    assert np.all(np.array(reaches[2]) < 1e-4 * np.array(reaches[0]))


@pytest.mark.parametrize("name", INSTANCES)
def test_float64_evaluation_stays_within_the_stated_errors(name):
    reference = moving(INSTANCES[name], seed=3)
    errors = evaluation_errors(reference, 10.0)
    times = np.random.default_rng(0).uniform(0, 2, 25)
    with mp.workdps(40):
        true = true_values(name, reference, times)
        for q in reference.quantities:
            off = [abs(mp.mpf(float(v)) - t) for v, t in zip(q(reference.signals, times), true[q.name], strict=True)]
            assert max(off) <= errors[q.name] < 1e-9


def tight(name: str, end: float = END, room: float = 1e-3, centres: int = 3) -> Reference:
    """Bounds that are touched but for a part of their width; the rest lies inside."""
    loose = moving(INSTANCES[name], seed=3, centres=centres)
    return bounded(loose, np.linspace(0, end, 2001), room)


def bounded(reference: Reference, times: np.ndarray, room: float) -> Reference:
    boxes = []
    for values, rest in (
        (reference.state_at(times), [q.mean for q in reference.signals]),
        (reference.input_at(times), [q.at_rest([s.mean for s in reference.signals])
                                     for q in reference.plant.flatness.inputs]),
    ):  # fmt: skip
        low, high = (np.minimum(values.min(0), rest), np.maximum(values.max(0), rest))
        width = high - low
        boxes.append(Polytope.box(low - room * width - 1e-2 * (low == rest) * width,
                                  high + room * width + 1e-2 * (high == rest) * width))  # fmt: skip
    return replace(reference, plant=replace(reference.plant, state_set=boxes[0], input_set=boxes[1]))


def as_read(certificate: Certificate) -> dict[str, Any]:
    return json.loads(json.dumps(certificate.to_dict()))


@cache
def proved(name: str) -> Certificate:
    found = prove_always(tight(name, room=1e-2, centres=2))
    assert isinstance(found, Certificate), found.explanation
    return found


@pytest.mark.parametrize("name", INSTANCES)
def test_certificates_are_found_and_checked(name):
    data = as_read(proved(name))
    verdict = check(data)
    assert isinstance(verdict, Proved), verdict
    assert "For all real t ≥ 0" in verdict.statement
    for state in INSTANCES[name].states:
        assert f"{state}⁺ = " in verdict.statement
    assert as_read(Certificate.from_dict(data)) == data
    assert "trajectories" not in data


def test_the_statement_holds_the_law():
    assert (
        "system level⁺ = (level + (0.05 * (inflow - (0.6 * sqrt(level))))) follows"
        in check(as_read(proved("tank"))).statement
    )


CLAIMS = {
    "a window": lambda: prove_on_window(tight("harvest", 1.0), 0.0, 1.0),
    "instants": lambda: prove_at_instants(tight("tank")),
    "all phases": lambda: prove_always(periodic()),
}


def periodic() -> Reference:
    loose = moving(INSTANCES["tank"])
    signal = replace(loose.signals[0], kernel=Periodic(1.0, 1.5, 2.0))
    return bounded(replace(loose, signals=(signal,)), np.linspace(0, 2.0, 2001), 1e-3)


@pytest.mark.parametrize("claim", CLAIMS)
def test_every_claim_can_be_made(claim):
    found = CLAIMS[claim]()
    assert isinstance(found, Certificate), found.explanation
    assert isinstance(check(as_read(found)), Proved)


@pytest.mark.parametrize("name", INSTANCES)
def test_an_input_bound_that_is_broken_is_refuted(name):
    """By a time at which many digits break it too."""
    reference = tight(name, room=-1e-3)
    found = prove_always(reference)
    assert isinstance(found, Counterexample), found.explanation
    with mp.workdps(40):
        value = exactly(INSTANCES[name], reference, found.time)[found.quantity]
        assert max(found.bounds.lower - value, value - found.bounds.upper) >= found.violation > 0


def test_rows_of_several_inputs():
    plant = INSTANCES["reactor"].plant
    rows = Polytope(np.array([[1.0, 1.0], [0.5, -1.0]]), [-9.0, -9.0], [9.0, 9.0])
    reference = replace(moving(INSTANCES["reactor"], size=0.1), plant=replace(plant, input_set=rows))
    found = prove_on_window(reference, 0.0, 0.5)
    assert isinstance(found, Certificate), found.explanation
    assert "-9.0 ≤ feed + cooling ≤ 9.0, -9.0 ≤ 0.5 feed + -1.0 cooling ≤ 9.0" in check(as_read(found)).statement


# ---- linear systems written as nonlinear ones


@pytest.mark.parametrize("room", [1e-3, -1e-3])
def test_a_linear_system_written_as_a_nonlinear_one_has_the_same_verdict(room):
    signals, sets = moving(INSTANCES["vehicle"], seed=3).signals, Polytope.box([-9.0, -9.0], [9.0, 9.0])
    loose = Reference(signals, ConstrainedSystem(LINEAR, sets, sets))
    plain = bounded(loose, np.linspace(0, END, 1001), room)
    written = replace(plain, plant=replace(plain.plant, system=as_formulas(LINEAR)))
    first, second = prove_always(plain), prove_always(written)
    assert type(first) is type(second) is (Certificate if room > 0 else Counterexample)
    if isinstance(first, Certificate):
        assert isinstance(check(as_read(first)), Proved)
        assert isinstance(check(as_read(second)), Proved)
        assert first.claim == second.claim
        for name, error in first.evaluation_error.items():
            assert second.evaluation_error[name] < 20 * error
    else:
        assert first.quantity == second.quantity
        assert first.violation == pytest.approx(second.violation, abs=1e-9)


# ---- attack: random references whose bounds are kept or broken by a hair


def random_reference(seed: int) -> tuple[str, Reference]:
    rng = np.random.default_rng(seed)
    name = ("tank", "harvest", "pendulum", "growth", "tank", "vehicle")[seed % 6]
    loose = moving(INSTANCES[name], seed, size=0.3, centres=int(rng.integers(1, 4)))
    length = rng.uniform(0.25, 1.0)
    signals = tuple(replace(s, kernel=SquaredExponential(1.0, length)) for s in loose.signals)
    loose = replace(loose, signals=signals)
    room = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-7, -3))
    return name, bounded(loose, np.linspace(0, 1.0, 20_001), room)


def smallest_margins(name: str, reference: Reference, end: float) -> dict:
    """Of each quantity, in many digits, at the times where float64 sees the smallest."""
    grid, found = np.linspace(0, end, 8001), {}
    for q in reference.quantities:
        near = grid[np.argsort(q.margin(reference.signals, grid))[:1]]
        fine = np.unique(np.clip(near + np.linspace(-2e-4, 2e-4, 401) * end, 0, end))
        at = fine[np.argmin(q.margin(reference.signals, fine))]
        value = exactly(INSTANCES[name], reference, at)[q.name]
        found[q.name] = min(value - mp.mpf(q.bounds.lower), mp.mpf(q.bounds.upper) - value)
    return found


@pytest.mark.parametrize("chunk", range(4))
def test_nothing_false_is_ever_claimed(chunk):
    said: Counter[type] = Counter()
    for seed in range(12 * chunk, 12 * (chunk + 1)):
        name, reference = random_reference(seed)
        found = prove_on_window(reference, 0.0, 1.0)
        said[type(found)] += 1
        with mp.workdps(40):
            margins = smallest_margins(name, reference, 1.0)
            if isinstance(found, Certificate):
                assert all(margins[q] >= found.evaluation_error[q] for q in margins), seed
            elif isinstance(found, Counterexample):
                assert min(margins.values()) < 0, seed
    assert said[Certificate] >= 2
    assert said[Counterexample] >= 2


# ---- tampering


def leaves(value: Any, path: tuple = ()) -> Iterator[tuple]:
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from leaves(inner, (*path, key))


def changed(data: dict, path: tuple, put: Any) -> dict:
    copied = copy.deepcopy(data)
    at = copied
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = put
    return copied


def got(data: Any, path: tuple) -> Any:
    for key in path:
        data = data[key]
    return data


def _is_true(data: dict) -> bool:
    """By a dense look at what the changed certificate says, whatever the proof in it."""
    certificate = Certificate.from_dict(data)
    reference, times = certificate.reference, np.linspace(0.0, 5.0, 20_001)
    return all(
        float(np.min(q.margin(reference.signals, times))) >= 0.99 * certificate.evaluation_error[q.name]
        for q in reference.quantities
    )


def test_no_change_of_the_system_or_the_reference_makes_it_prove_what_is_false(monkeypatch):
    """Short Taylor polynomials: hundreds of certificates are to be checked."""
    for module in (cover, prove):
        monkeypatch.setattr(module, "TERMS", 8)
    found = prove_always(tight("tank", centres=2))
    assert isinstance(found, Certificate)
    data = as_read(found)
    parts = [("system",), ("signals",), ("bounds",), ("evaluation",)]
    seen: Counter[type] = Counter()
    for part in parts:
        for path in leaves(got(data, part), part):
            value = got(data, path)
            if isinstance(value, float | int):
                news: list[Any] = [value * 1.01 + 1e-3, value * 0.99 - 1e-3, str(value)]
            elif isinstance(value, str):
                news = ["level", "inflow", "-", ""]
            else:
                news = [[], value[::-1]] if isinstance(value, list) else [{}]
            for new in news:
                if new == value and type(new) is type(value):
                    continue
                verdict = check(other := changed(data, path, new))
                seen[type(verdict)] += 1
                assert not isinstance(verdict, Proved) or _is_true(other), (path, new)
    assert seen[NotACertificate] > 30
    assert seen[Failed] > 30


put = changed


def _f(data: dict, f: Any) -> dict:
    return changed(data, ("system", "f"), [f])


LAW = ["+", "level", ["*", 0.05, ["-", "inflow", ["*", 0.6, ["sqrt", "level"]]]]]
TAMPERED = {
    "another constant": (lambda d: put(d, ("system", "f", 0, 2, 2, 2, 1), 0.62), Failed, "box: the inflow"),
    "another function": (lambda d: put(d, ("system", "f", 0, 2, 2, 2, 2, 0), "log"), Failed, "box: the inflow"),
    "another law": (lambda d: _f(d, ["+", "level", "inflow"]), Failed, "evaluation|box"),
    "an input squared": (lambda d: _f(d, ["^", "inflow", 2.0]), Failed, "system: f is not affine in inflow"),
    "an input in a function": (lambda d: _f(d, ["exp", "inflow"]), Failed, "system: f is not affine"),
    "an input below": (lambda d: _f(d, ["/", "level", "inflow"]), Failed, "system: f is not affine"),
    "no input": (lambda d: _f(d, "level"), Failed, "system: f cannot be solved for inflow|system: f"),
    "an input that cancels": (
        lambda d: _f(d, ["-", ["+", "level", "inflow"], "inflow"]), Failed, "evaluation: .* may be zero"),
    "an unknown name": (lambda d: _f(d, ["+", "inflow", "level⁺"]), Failed, "names: f must hold states and inputs"),
    "an unknown function": (lambda d: _f(d, ["tanh", "inflow"]), NotACertificate, "must be a formula"),
    "an operator for one": (lambda d: _f(d, ["+", "inflow"]), NotACertificate, "must be a formula"),
    "an exponent with a name": (lambda d: _f(d, ["^", "level", "inflow"]), NotACertificate, "must be a finite"),
    "two laws": (lambda d: put(d, ("system", "f"), [LAW, LAW]), Failed, "shapes: as many formulas"),
    "no law": (lambda d: put(d, ("system", "f"), []), NotACertificate, "must be a list, not empty"),
    "a matrix": (lambda d: {**d, "system": {**d["system"], "A": [[1.0]]}}, NotACertificate, "exactly the fields"),
    "trajectories": (lambda d: {**d, "trajectories": {}}, NotACertificate, "exactly the fields"),
    "a name twice": (lambda d: put(d, ("system", "inputs"), ["level"]), Failed, "names: states, states⁺ and inputs"),
    "a weight": (lambda d: put(d, ("signals", 0, "weights", 0), 1.1 * d["signals"][0]["weights"][0]), Failed, "box"),
    "a bound": (lambda d: put(d, ("bounds", 1, "upper"), 0.98 * d["bounds"][1]["upper"]), Failed, "box: the inflow"),
    "a free input": (lambda d: put(d, ("bounds", 1, "of"), "state"), Failed, "bounds: every input .* inflow is not"),
    "no room": (lambda d: put(d, ("evaluation", "errors", "inflow"), 1e-16), Failed, "evaluation: the inflow"),
    "an early tail": (
        lambda d: changed(put(d, ("claim", "tail_start"), 0.1), ("claim", "covers"),
                          {q: {"ends": [0.0, 0.1], "radii": [0.5]} for q in ("level", "inflow")}), Failed, "tail"),
}  # fmt: skip


@pytest.mark.parametrize("what", TAMPERED)
def test_tampered_certificates_are_refused(what):
    change, kind, reason = TAMPERED[what]
    verdict = check(change(as_read(proved("tank"))))
    assert isinstance(verdict, kind), verdict
    assert re.search(reason, verdict.reason), verdict.reason


def test_a_formula_that_is_deep_or_long_is_no_certificate():
    data, deep, long = as_read(proved("tank")), "inflow", "inflow"
    for _ in range(101):
        deep = ["+", deep, 1.0]
    for _ in range(11):
        long = ["+", long, copy.deepcopy(long)]
    for tree, reason in ((deep, "nested more than 100 deep"), (long, "no more than 1000 operations")):
        verdict = check(_f(data, tree))
        assert isinstance(verdict, NotACertificate)
        assert reason in verdict.reason


# ---- faults planted in the prover


def test_a_prover_with_a_wrong_function(monkeypatch):
    """Its exponential is a tenth too small, and with it the input that is certified."""
    steep = Nonlinear.of(lambda x, u: [x[0] + T_S * (u[0] - 5 * np.exp(20 * x[0]))], ("x",), ("u",), T_S)
    loose = Reference(moving(INSTANCES["pendulum"]).signals, ConstrainedSystem(steep, WIDE, WIDE))
    highest, right = loose.input_at(np.linspace(0, 1, 2001)).max(), models.composed

    def smaller(*arguments):
        found = right(*arguments)
        return Enclosure(found.coefficients * arb(0.9), found.remainder)

    monkeypatch.setattr(prove._Task, "_failure_at", lambda *_: None)
    monkeypatch.setattr(cover.Sketch, "smallest", lambda *_: 1.0)
    monkeypatch.setattr(models, "composed", smaller)
    false = replace(loose, plant=replace(loose.plant, input_set=BOX([-99.0], [highest - 1e-2])))
    found = prove_on_window(false, 0.0, 1.0)
    assert isinstance(found, Certificate), found.explanation
    verdict = check(as_read(found))
    assert isinstance(verdict, Failed)
    assert verdict.reason.startswith("box: the u")


def test_a_prover_that_takes_another_law(monkeypatch):
    right = prove.exact_quantities
    other = replace(
        tight("tank"),
        plant=replace(
            tight("tank").plant, system=Nonlinear.of(lambda x, u: [x[0] + 0.05 * u[0]], ("level",), ("inflow",), T_S)
        ),
    )
    monkeypatch.setattr(prove._Task, "_failure_at", lambda *_: None)
    monkeypatch.setattr(prove, "exact_quantities", lambda _: right(tight("tank")))
    monkeypatch.setattr(cover.Sketch, "smallest", lambda *_: 1.0)
    found = prove_on_window(other, 0.0, 1.0)
    assert isinstance(found, Certificate), found.explanation
    assert isinstance(check(as_read(found)), Failed)


# ---- refusals


def with_sets(name: str, states: Polytope, inputs: Polytope, **change: float) -> Reference:
    reference = moving(INSTANCES[name], **change)
    return replace(reference, plant=replace(reference.plant, state_set=states, input_set=inputs))


def test_a_set_with_states_that_have_no_input_is_refused():
    found = prove_always(with_sets("tank", BOX([0.0], [9.0]), WIDE))
    assert isinstance(found, Unproved)
    assert (
        "with states anywhere in their set, its formula takes the square root of something that may not be positive"
        in (found.explanation)
    )


def test_a_broken_state_bound_is_told_even_then():
    seen = moving(INSTANCES["tank"]).state_at(np.linspace(0, 1, 100))
    found = prove_always(with_sets("tank", BOX([0.0], [seen.min() + 1e-3]), WIDE))
    assert isinstance(found, Counterexample)
    assert found.quantity == "level"


def test_states_that_leave_the_domain_have_no_input():
    found = prove_on_window(with_sets("tank", BOX([-9.0], [9.0]), WIDE, size=3.0), 0.0, 2.0)
    assert isinstance(found, Unproved)
    assert found.quantity == "inflow"
    assert "the square root of something that may not be positive" in found.explanation


def test_a_gain_that_may_be_zero_is_not_divided_by():
    found = prove_on_window(with_sets("harvest", BOX([-9.0], [9.0]), WIDE, size=3.0), 0.0, 2.0)
    assert isinstance(found, Unproved | Counterexample)
    assert found.quantity == "effort"
    certain = with_sets("harvest", BOX([-0.5], [2.0]), WIDE)
    found = prove_always(certain)
    assert isinstance(found, Unproved)
    assert "with states anywhere in their set, its formula divides by something that may be zero" in found.explanation


# ---- learning


def samples_of(reference: Reference, seed: int) -> tuple[Samples, ...]:
    times, rng = np.linspace(0.0, 3.0, 12), np.random.default_rng(seed)
    clean = reference.state_at(times).T
    return tuple(Samples(times, values + 0.02 * rng.standard_normal(12)) for values in clean)


@pytest.mark.parametrize("name", ["tank", "reactor"])
def test_a_reference_is_learned_with_its_proof(name):
    """Input bounds that the samples themselves would break."""
    moved, n = moving(INSTANCES[name], seed=5), len(INSTANCES[name].states)
    data = samples_of(moved, 0)
    at_rest = [q.at_rest(INSTANCES[name].rest) for q in moved.plant.flatness.inputs]
    reached = np.abs(moved.input_at(np.linspace(0, 3, 300)) - at_rest).max(0)
    sets = BOX(at_rest - 0.6 * reached, at_rest + 0.6 * reached)
    plant = replace(moved.plant, input_set=sets)
    priors = tuple(
        Prior(SquaredExponential(0.3, 0.7), 0.02, level, frozenset({"noise_std"})) for level in INSTANCES[name].rest
    )
    prior = JointPrior(priors, INSTANCES[name].states if n > 1 else ("",))
    found = learn_certified(data, prior, plant, SearchSpace.around(data, prior, starts=2))
    assert isinstance(found, Certified), found.explanation
    k = np.arange(200.0)
    x, u = found.reference.state(k), found.reference.input(k)
    assert plant.state_set.margin(x).min() > 0
    assert 0 < plant.input_set.margin(u).min() < 0.05
    np.testing.assert_allclose(plant.system.successor(x[:-1], u[:-1]), x[1:], atol=1e-12)
