"""Faults planted in the prover: it then issues false certificates, and the checker, which shares nothing, says so."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from tests.trackable.certificates.instances import wide
from tests.trackable.certificates.references import certified, unconstrained
from trackable.certificates import cover, exact, prove, settled
from trackable.certificates.boxes import decision, enclosures
from trackable.certificates.certificate import Certificate
from trackable.certificates.cover import Cover
from trackable.certificates.floats.choice import zero
from trackable.certificates.kernels.matern import Matern32Balls
from trackable.certificates.kernels.piecewise_polynomial import PiecewisePolynomialBalls
from trackable.certificates.rounding import references as rounding
from trackable.certificates.sketch import Sketch
from trackable.checker import Failed, Proved, check
from trackable.codec.certificates import encode_certificate
from trackable.gp.kernels.matern import Matern32
from trackable.gp.kernels.piecewise_polynomial import PiecewisePolynomial2
from trackable.gp.kernels.squared_exponential import SquaredExponential
from trackable.gp.signal import KernelSum
from trackable.learning.published.scalar import scalar
from trackable.systems.constrained import ConstrainedSystem
from trackable.systems.linear import LinearSystem
from trackable.systems.reference import Reference
from trackable.systems.sets.interval import Interval
from trackable.systems.sets.polytope import Polytope


def small(kernel, state_set=(-2.0, 2.0), input_set=(-2.0, 2.0), a=0.9) -> Reference:
    sets = {"state_set": Interval(*state_set), "input_set": Interval(*input_set)}
    plant = scalar(a, 0.5, **sets, sampling_time=0.05)
    return Reference((KernelSum(kernel, 0.0, np.array([0.0, 0.4, 0.9]), np.array([0.5, -0.8, 0.3])),), plant)


def axis(bound: float = 20.0) -> Reference:
    """A double integrator, bounded in position, velocity, their sum and acceleration."""
    system = LinearSystem(
        np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]]), np.array([0.0, 0.02]), sampling_time=0.1
    )
    states = Polytope(np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]), -np.full(3, 4.0), np.full(3, 4.0))
    plant = ConstrainedSystem(system, states, Polytope.box(np.array([-bound]), np.array([bound])))
    signal = KernelSum(SquaredExponential(1.0, 0.4), 0.1, np.array([0.0, 0.4, 0.9]), np.array([0.5, -0.8, 0.3]))
    return Reference((signal,), plant)


def assert_caught(reference: Reference, *reasons: str) -> None:
    found = prove.prove(reference)
    assert isinstance(found, Certificate), found.explanation
    verdict = check(encode_certificate(found))
    assert isinstance(verdict, Failed), verdict
    assert verdict.reason.startswith(reasons), verdict.reason


@pytest.fixture(params=["example1", "example2"], scope="module")
def learned(request) -> Reference:
    """Made before anything is planted."""
    return certified(request.param).reference


@pytest.fixture(params=["example1", "example2"], scope="module")
def broken(request) -> Reference:
    return unconstrained(request.param)


def nothing_missed(*arguments) -> np.ndarray:
    return np.zeros(len(arguments[1]))


@pytest.fixture
def blind(monkeypatch):
    """The search for a counterexample finds nothing, and envelopes are proved."""
    monkeypatch.setattr(settled, "nearly_settled", lambda *_: None)
    monkeypatch.setattr(prove._ProofProblem, "_failure_at", lambda *_: None)


def test_a_prover_that_believes_every_box(broken, monkeypatch, blind):
    monkeypatch.setattr(decision, "are_positive", lambda of: np.ones(of.mid.shape[1], dtype=bool))
    monkeypatch.setattr(enclosures, "missed", nothing_missed)
    monkeypatch.setattr(Sketch, "within", wide)
    assert_caught(broken, "box")


def test_a_prover_that_forgets_the_remainder(monkeypatch, blind):
    monkeypatch.setattr(enclosures, "missed", nothing_missed)
    for module in (cover, prove):
        monkeypatch.setattr(module, "TERMS", 2)
    assert_caught(small(SquaredExponential(1.0, 0.3)), "box")


def test_a_prover_with_a_wrong_kernel(monkeypatch, blind):
    right = enclosures.polynomials
    monkeypatch.setattr(enclosures, "polynomials", lambda *arguments: right(*arguments) * 0.25)
    monkeypatch.setattr(Sketch, "within", wide)
    assert_caught(small(SquaredExponential(1.0, 0.3), state_set=(-0.4, 0.3)), "box")


def test_a_prover_that_overlooks_kinks(monkeypatch, blind):
    monkeypatch.setattr(Matern32Balls, "kinks", ())
    assert_caught(small(Matern32(1.0, 0.3), state_set=(-0.71, 0.34)), "box")


def test_a_prover_that_overlooks_where_a_support_ends(monkeypatch, blind):
    """A box whose middle is beyond the support, as if all of it was; z = φ(0.9) = 1.2e-4 where it begins."""
    monkeypatch.setattr(PiecewisePolynomialBalls, "jump", lambda _, r, half: zero(r))
    monkeypatch.setattr(Sketch, "within", wide)
    plant = small(SquaredExponential(1.0, 0.3), state_set=(-2.0, 5e-5)).plant
    reference = Reference((KernelSum(PiecewisePolynomial2(1.0, 0.5), 0.0, np.zeros(1), np.ones(1)),), plant)
    found = prove.prove_on_window(reference, 0.45, 0.65)
    assert isinstance(found, Certificate), found.explanation
    verdict = check(encode_certificate(found))
    assert isinstance(verdict, Failed)
    assert verdict.reason.startswith("box: the state")


def test_a_prover_that_takes_the_wrong_branch(monkeypatch, blind):
    right = enclosures.polynomials
    monkeypatch.setattr(enclosures, "polynomials", lambda *arguments: right(*arguments) * 0)
    monkeypatch.setattr(PiecewisePolynomialBalls, "jump", lambda _, r, half: zero(r))
    monkeypatch.setattr(Sketch, "within", wide)
    assert_caught(small(PiecewisePolynomial2(1.0, 0.5), state_set=(-0.4, 0.3)), "box")


def test_a_prover_whose_cover_ends_too_early(learned, monkeypatch, blind):
    right = prove.covers
    shortened = lambda *arguments: [Cover(each.ends[:-1], each.radii[:-1]) for each in right(*arguments)]  # noqa: E731
    monkeypatch.setattr(prove, "covers", shortened)
    assert_caught(learned, "cover")


def test_a_prover_whose_cover_has_a_hole(learned, monkeypatch, blind):
    right = prove.covers
    holed = lambda *a: [Cover((each.ends[0], *each.ends[2:]), each.radii[1:]) for each in right(*a)]  # noqa: E731
    monkeypatch.setattr(prove, "covers", holed)
    assert_caught(learned, "box")


def test_a_prover_that_settles_too_early(monkeypatch, blind):
    monkeypatch.setattr(settled, "float_below", lambda _: 1.0)
    assert_caught(small(SquaredExponential(1.0, 0.3), state_set=(-2.0, 0.45)), "tail")


def test_a_prover_that_forgets_rounding(monkeypatch):
    tiny = {"state": 1e-300, "input": 1e-300}
    monkeypatch.setattr(prove, "evaluation_errors", lambda *_: tiny)
    assert_caught(small(SquaredExponential(1.0, 0.3)), "evaluation")


def test_a_prover_that_takes_any_length_scale_for_a_period(monkeypatch, blind):
    monkeypatch.setattr(prove, "reference_period", lambda _: 1.0)
    assert_caught(small(SquaredExponential(1.0, 0.3)), "period")


def test_a_prover_with_a_wrong_sign_in_the_system(monkeypatch, blind):
    """As if x⁺ = −a x + b u: the true input is half as large again, or more."""
    right = exact.exact_quantities

    def mistaken(reference):
        state, inputs = right(reference)
        ((name, functional),) = inputs.arguments.items()
        (weight, now), later = functional.terms
        return state, replace(inputs, arguments={name: replace(functional, terms=((-weight, now), later))})

    monkeypatch.setattr(prove, "exact_quantities", mistaken)
    monkeypatch.setattr(Sketch, "within", wide)
    monkeypatch.setattr(settled, "float_below", lambda _: 1.0)
    learned = small(SquaredExponential(1.0, 3.0), input_set=(-0.2, 0.2), state_set=(-1.0, 1.0), a=-0.9)
    assert_caught(learned, "box", "tail")


def test_the_axis_is_proved_before_anything_is_planted():
    found = prove.prove(axis())
    assert isinstance(found, Certificate) and isinstance(check(encode_certificate(found)), Proved)  # noqa: PT018


def mistaken(reference: Reference, **changes) -> Reference:
    """The same reference, by a plant that believes something else about its flat outputs."""
    plant = replace(reference.plant)
    plant.__dict__["flatness"] = replace(reference.plant.flatness, **changes)
    return Reference(reference.signals, plant)


def test_a_prover_with_a_wrong_flat_output():
    """The acceleration as if the velocity came from the difference to the last step."""
    right = axis()
    (weights,) = right.plant.flatness.inputs[0].weights
    halved = replace(right.plant.flatness.inputs[0], weights=((weights[0] / 2, *weights[1:]),))
    assert_caught(mistaken(right, inputs=(halved,)), "trajectories: the system does not follow signal 0")


def test_a_prover_with_rounded_flat_outputs():
    """As good as exact in float64, and no identity."""
    right = axis()
    (weights,) = right.plant.flatness.inputs[0].weights
    rounded = replace(right.plant.flatness.inputs[0], weights=(tuple(Fraction(float(w)) for w in weights),))
    assert rounded != right.plant.flatness.inputs[0]
    assert_caught(mistaken(right, inputs=(rounded,)), "trajectories: the system does not follow signal 0")


def test_a_prover_that_forgets_the_drift():
    right = axis()
    (drifting,) = right.plant.flatness.inputs
    assert drifting.offset != 0
    still = (replace(drifting, offset=Fraction(0)),)
    assert_caught(mistaken(right, inputs=still), "trajectories: the system does not stay")


def test_a_prover_that_takes_a_row_for_another(monkeypatch, blind):
    """It looks at the position where the sum of position and velocity is bounded."""
    right = exact.exact_quantities

    def confused(reference):
        position, velocity, total, acceleration = right(reference)
        return position, velocity, replace(position, name=total.name, bounds=total.bounds), acceleration

    reference = axis()
    narrow = replace(reference.plant.state_set, lower=-np.array([4, 4, 0.8]), upper=np.array([4, 4, 0.8]))
    monkeypatch.setattr(prove, "exact_quantities", confused)
    monkeypatch.setattr(Sketch, "within", wide)
    assert_caught(Reference(reference.signals, replace(reference.plant, state_set=narrow)), "box: the x1+x2")


def test_a_prover_that_takes_the_envelope_for_narrower(monkeypatch, blind):
    right = settled.limits_beyond

    def forgetful(reference, start):
        limits = right(reference, start)
        return {name: (centre, reach / 1000) for name, (centre, reach) in limits.items()}

    monkeypatch.setattr(settled, "limits_beyond", forgetful)
    assert_caught(axis(bound=12.0), "tail: the envelope of the u1")


def test_a_prover_that_forgets_what_does_not_cancel_in_float64(monkeypatch):
    """Rounding of a velocity of 1/T_s differences of positions, as if it were that of its value."""
    right = rounding.evaluation_errors

    def optimistic(*arguments):
        return {name: error / 1e3 for name, error in right(*arguments).items()}

    monkeypatch.setattr(prove, "evaluation_errors", optimistic)
    assert_caught(axis(), "evaluation: the x1 can be off")
