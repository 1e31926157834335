"""Bounds are kept by every plant of a hull, and what the checker accepts is no more than that."""

from dataclasses import replace

import numpy as np
import pytest

from tests.trackably.checker.changes import changed, part_at
from tests.trackably.plants import SLIDE
from tests.trackably.saved import assert_comes_back
from trackably import (
    ConstrainedSystem,
    LinearSystem,
    ModelError,
    Plan,
    Polytope,
    Samples,
    SquaredExponential,
    Truth,
    TubeController,
    Zonotope,
    learn_reference,
    worst_plant,
)
from trackably.certificates.form import encode_certificate
from trackably.checker import Failed, NotACertificate, Proved, check
from trackably.systems.tightening import tightening

T, (A, B) = 0.02, (SLIDE.system.A.tolist(), SLIDE.system.B)
W = Zonotope.box([0.0, -5e-4], [0.0, 5e-4])
TIMES = np.arange(0.0, 2.0, 0.1)
SAMPLES = Samples(TIMES, 0.08 * np.sin(1.8 * TIMES) + 0.001 * np.cos(70 * TIMES))


def gain(by):
    return ModelError.of([(A, (1 - by) * B), (A, (1 + by) * B)])


def learn(**more):
    return learn_reference(SAMPLES, SLIDE, SquaredExponential(), (0.0, 1.9), noise_std=0.001, starts=1, **more)


@pytest.fixture(scope="module")
def learned():
    truth = Truth(noise=0.0015, second_derivative=0.5)
    noise = Zonotope.box([-2e-4, -5e-4], [2e-4, 5e-4])
    return learn(model_error=gain(0.2), disturbance=W, measurement_noise=noise, truth=truth)


@pytest.mark.parametrize("seed", range(6))
def test_what_is_added_to_the_disturbance_holds_all_differences(seed):
    draw = np.random.default_rng(seed)
    n, m, q = draw.integers(1, 4), draw.integers(1, 3), draw.integers(1, 5)
    A, B, c = (draw.normal(size=(q, *shape)) for shape in ((n, n), (n, m), (n,)))
    if seed % 2:  # one parameter
        A, B, c = (of[:1] + np.linspace(-1, 2, q).reshape(-1, *[1] * (of.ndim - 1)) * of[-1:] for of in (A, B, c))
    low, high = -draw.uniform(0.1, 2, n + m), draw.uniform(0.1, 2, n + m)
    nominal = LinearSystem(*(of.mean(axis=0) + draw.normal(size=of.shape[1:]) for of in (A, B, c)), sampling_time=1.0)
    (x_low, u_low), (x_high, u_high) = np.split(low, [n]), np.split(high, [n])
    plant = ConstrainedSystem(nominal, Polytope.box(x_low, x_high), Polytope.box(u_low, u_high))
    D = Zonotope(np.zeros(n), ModelError.of(list(zip(A, B, c, strict=True))).generators(plant))
    rows = draw.normal(size=(40, n))
    for hull in draw.dirichlet(np.ones(q), 40):
        x, u = np.split(np.where(draw.random(n + m) < 0.5, low, high), [n])
        d = hull @ (A @ x + B @ u + c) - nominal.successor(x, u)
        assert np.all(rows @ d <= D.support(rows) + 1e-9)


def test_the_worst_plants_keep_all_bounds(learned):
    K = learned.tightening.invariant.feedback
    for disturbance in (None, W):
        found = worst_plant(learned, SLIDE, gain(0.2), K, 94, disturbance=disturbance)
        assert not found.breaks
    assert set(found.vertices) <= {0, 1}
    broken = worst_plant(learned, SLIDE, ModelError.of([(A, 12 * B)]), K, 94)
    assert broken.breaks
    assert "breaks" in str(broken)
    free = replace(SLIDE, state_set=Polytope.box([-np.inf] * 2, [np.inf] * 2), input_set=Polytope.box(-np.inf, np.inf))
    with pytest.raises(ValueError, match="expected a plant with bounds"):
        worst_plant(learned, free, gain(0.2), K, 94)


def test_the_tube_controller_always_has_a_plan_and_the_plant_stays_near_the_signal(learned):
    (truth,), draw = learned.certificate.truth, np.random.default_rng(0)
    assert truth.plant > truth.error
    tube, x = TubeController(learned.tightening, 8), learned.state(0)
    for k in range(80):
        v = draw.choice([-1.0, 1.0], 2) * [2e-4, 5e-4]
        plan = tube.step(k, x + v, learned)
        assert isinstance(plan, Plan)
        x = np.array(A) @ x + draw.choice([0.8, 1.2]) * B @ plan.input + [0.0, draw.choice([-5e-4, 5e-4])]
        assert np.all((SLIDE.state_set.lower <= x) & (x <= SLIDE.state_set.upper))
        assert abs(x[0] - 0.08 * np.sin(1.8 * T * (k + 1))) <= truth.plant


def test_what_is_proved_is_stated_and_comes_back_when_it_is_saved(learned, tmp_path):
    assert_comes_back(learned, tmp_path)
    assert "under every disturbance in " in learned.explanation
    verdict, (truth,) = check(encode_certificate(learned.certificate)), learned.certificate.truth
    assert isinstance(verdict, Proved)
    assert "convex hull of A = [[1.0, 0.02], [0.0, 1.0]]" in verdict.statement
    assert f"the state of the system is within {truth.plant!r} of f" in verdict.statement


MODEL = ("disturbance", "model")
CHANGES = {
    "larger": ((*MODEL, 0, "B"), [[T**2 / 8], [T / 4]]),
    "another": (MODEL, lambda model: [*model, {"A": A, "B": (3 * B).tolist(), "c": [0.0, 0.0]}]),
    "offset": ((*MODEL, 1, "c"), [0.01, 0.0]),
    "shape": ((*MODEL, 0, "c"), [0.0]),
    "empty": (MODEL, []),
    "hull": (("disturbance", "set"), {"kind": "hull", "vertices": [["0", "0"]]}),
    "nearer": (("truth", 0, "plant"), lambda error: error * (1 - 1e-9)),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_certificate_is_refused(learned, name):
    content, (path, value) = encode_certificate(learned.certificate), CHANGES[name]
    content = changed(content, path, value(part_at(content, path)) if callable(value) else value)
    assert isinstance(check(content), Failed | NotACertificate)


def test_the_message_says_which_bounds_are_too_close_for_the_error():
    with pytest.raises(ValueError, match=r"^model_error: the errors take .* of acceleration, which are too close by"):
        tightening(SLIDE, W, [[-100.0, -20.0]], model_error=gain(2.0))


def test_intervals_of_entries_are_all_their_corners():
    entries = {("velocity", "acceleration"): (0.01, 0.03), ("position", "1"): (-1e-3, 1e-3)}
    found = ModelError.intervals(SLIDE.system, entries)
    assert {(v.B[1, 0], v.c[0]) for v in found.vertices} == {(b, c) for b in (0.01, 0.03) for c in (-1e-3, 1e-3)}


def test_continuous_plants_are_sampled_only_where_that_is_exact():
    rates = [[0.0, 1.0], [0.0, -0.5]]
    found = ModelError.sampled([(rates, [[0.0], [0.8]]), (rates, [[0.0], [1.2]])], T)
    middle = LinearSystem.discretised(rates, [[0.0], [1.0]], T)
    np.testing.assert_allclose((found.vertices[0].B + found.vertices[1].B) / 2, middle.B, rtol=1e-13)
    with pytest.raises(ValueError, match="is nonlinear in A"):
        ModelError.sampled([(rates, [[0.0], [1.0]]), ([[0.0, 1.0], [0.0, -0.6]], [[0.0], [1.0]])], T)


def test_what_nothing_bounds_is_refused():
    free = replace(SLIDE, state_set=Polytope([[1.0, 0.0]], [-0.2], [0.2], 2))
    wrong = ModelError.intervals(SLIDE.system, {("velocity", "velocity"): (0.99, 1.01)})
    with pytest.raises(ValueError, match="no constant bounds of the state 1"):
        tightening(free, W, [[-100.0, -20.0]], model_error=wrong)
    opens = replace(SLIDE, state_set=Polytope.box([-0.2, -0.5], [0.2, {0.0: 0.5, 1.0: 0.6}]))
    with pytest.raises(ValueError, match="no constant bounds of the state 1"):
        wrong.generators(opens)
    tightening(free, W, [[-100.0, -20.0]], model_error=gain(0.1))
