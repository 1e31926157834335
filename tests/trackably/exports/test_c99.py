"""Headers in C compile without a warning, and what they compute is within the bound that the certificate names."""

import subprocess
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.splines.naive import quantity_at
from tests.trackably.exports.c_programs import CC, STRICT, compiled, run
from tests.trackably.exports.references import nonlinear, on_window, periodic
from tests.trackably.plants import AXIS
from tests.trackably.systems.redundant_instances import random_case
from trackably import (
    ConstrainedSystem,
    Kernel,
    Matern52,
    Periodic,
    PiecewisePolynomial2,
    Polytope,
    RationalQuadratic,
    SquaredExponential,
)
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.draft import Draft, evaluation_errors
from trackably.certificates.form import encode_subject
from trackably.checker.certificate import Cover, Window
from trackably.checker.form import subject_of
from trackably.checker.intervals import exactly
from trackably.checker.piecewise import evaluation_errors as errors_of_pieces
from trackably.exports.c99 import header
from trackably.exports.proved import Proved
from trackably.gp.signal import KernelSum
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference

pytestmark = pytest.mark.skipif(CC is None, reason="there is no C compiler")

RNG = np.random.default_rng(5)
KERNELS: dict[str, Kernel] = {
    "rational quadratic": RationalQuadratic(0.7, 0.31, 1.3),
    "piecewise polynomial 2": PiecewisePolynomial2(0.7, 0.9),
    "product of a sum": (Periodic(1.1, 0.9, 1.7) + Matern52(1.3, 0.31)) * SquaredExponential(1.2, 1.4),
}


def stub(reference: Reference) -> Proved:
    """A reference with the bounds of its rounding, as certificates have them; nothing else is of interest here."""
    if reference.pieces:
        of_pieces = errors_of_pieces(subject_of(encode_subject(reference)), Fraction(-2), Fraction(6))
        errors = {name: float(error) * (1 + 1e-15) for name, error in of_pieces.items()}
    else:
        errors = evaluation_errors(reference, 100.0)
    certificate = Certificate(reference, Window(-2.0, 6.0), Cover(-2.0, 6.0, {}, 0), errors, 100.0)
    found: Proved = SimpleNamespace(  # type: ignore[assignment]
        reference=reference, certificate=certificate, explanation="", sampled={}
    )
    return found


def random_sum(kernel: Kernel, mean: float = 0.125) -> KernelSum:
    centres = np.sort(RNG.uniform(0, 4, 9))
    return KernelSum(kernel, mean, centres, RNG.standard_normal(9))


def require_within_certified_errors(proved: Proved, times: Array, values: Array, largest: float = 1e-7) -> None:
    """The distance of each value to the exact one, in intervals, is at most what the certificate says."""
    draft = Draft.of(proved.reference, 100.0, np.zeros(1))
    assert {*draft.errors} & {*proved.reference.plant.names}
    for name, column in zip(proved.reference.plant.names, values.T, strict=True):
        if name not in draft.errors:
            continue
        error = proved.certificate.evaluation_error[name]
        assert 0 < error < largest
        for t, value in zip(times.tolist(), column.tolist(), strict=True):
            assert abs(draft.value(name, Fraction(t)) - exactly(value)) <= exactly(error), (name, t)


TIMES = np.concatenate([RNG.uniform(-2, 6, 6), [0.0, 0.5, 1.0, 4.0]])


@pytest.mark.parametrize("name", KERNELS)
def test_values_of_each_kernel_are_within_the_certified_error(name: str, tmp_path: Path) -> None:
    proved = stub(Reference((random_sum(KERNELS[name]),), AXIS))
    refused, values = run(compiled(proved, tmp_path), TIMES)
    assert not refused.any()
    require_within_certified_errors(proved, TIMES, values)


def random_pieces(kind: str, beyond: str) -> PolynomialPieces:
    """Cubic pieces that meet, or steps; breakpoints are near to multiples of the sampling time."""
    times = np.linspace(0.0, 4.0, 9) if kind == "spline" else np.array([0.0, 0.35, 0.6000000000000001, 1.45, 4.0])
    times = np.array([0.0, 0.1, 0.15000000000000002, 0.3]) if (kind, beyond) == ("steps", "period") else times
    spline = CubicSpline(times, np.append(RNG.standard_normal(len(times) - 1), 0.0), bc_type="natural")
    coefficients = spline.c[::-1].T if kind == "spline" else RNG.standard_normal((len(times) - 1, 2))
    return PolynomialPieces(times, coefficients, beyond)  # type: ignore[arg-type]


AT_OR_STEP = "t < 100 ? reference_at(t, x, u) : reference_step((long)t - 100, x, u)"


@pytest.mark.parametrize(
    ("kind", "beyond"), [("spline", "period"), ("steps", "rest"), ("steps", "period"), ("steps", "end")]
)
def test_values_of_polynomial_pieces_are_within_the_certified_error(kind: str, beyond: str, tmp_path: Path) -> None:
    pieces, wide = random_pieces(kind, beyond), [1e4, 1e4]
    plant = ConstrainedSystem(AXIS.system, Polytope.box([-1e4, -1e4], wide), Polytope.box([-1e4], [1e4]))
    proved = stub(Reference((pieces,), plant))
    ends = pieces.breakpoints[:-1] + (np.arange(-6, 20)[:, None] * pieces.period if beyond == "period" else 0.0)
    times = np.concatenate([TIMES, *(of.ravel() for of in (ends, np.nextafter(ends, 99), np.nextafter(ends, -99)))])
    first, last = (0.0, 3.85) if beyond == "end" else (-2.0, 6.0)
    times = times[(first <= times) & (times < last)]
    k, reference = np.arange(76), proved.reference
    refused, values = run(compiled(proved, tmp_path, AT_OR_STEP), np.concatenate([times, 100.0 + k]))
    assert not refused.any()
    exact = [*map(Fraction, times.tolist()), *(i * Fraction(plant.sampling_time) for i in k.tolist())]
    require_nearest(proved, exact, values)
    at_steps = np.hstack([reference.state(k), reference.input(k)])
    np.testing.assert_allclose(values[len(times) :], at_steps, rtol=3e-16, atol=1e-25)


def require_nearest(proved: Proved, times: list[Fraction], values: Array) -> None:
    """Values are those of rational arithmetic, rounded once, and within the bound of the certificate."""
    flatness = proved.reference.plant.flatness
    for name, coordinate, column in zip(AXIS.names, (*flatness.states, *flatness.inputs), values.T, strict=True):
        error = Fraction(proved.certificate.evaluation_error[name])
        for t, value in zip(times, column.tolist(), strict=True):
            exact = quantity_at(coordinate.functional, proved.reference.pieces, t)
            assert abs(exact - Fraction(value)) <= min(error, abs(exact) / 2**52 + Fraction(1, 10**25))


def test_values_of_a_proved_reference_are_within_the_certified_error(tmp_path: Path) -> None:
    proved = nonlinear()
    times = np.concatenate([RNG.uniform(0, 3, 6), proved.reference.instants(np.arange(6))])
    refused, values = run(compiled(proved, tmp_path), times)
    assert not refused.any()
    require_within_certified_errors(proved, times, values)
    np.testing.assert_allclose(values[:, : len(proved.reference.plant.system.states)], proved(times), atol=1e-11)


def test_times_that_are_not_proved_are_refused_as_in_python(tmp_path: Path) -> None:
    times = np.array([-1e-9, -1.0, 0.0, 1.5, 3.0, np.nextafter(3.0, 4.0), 3.0 * (1 + 5e-13), 1e9, np.inf])
    refused, values = run(compiled(on_window(), tmp_path), times)
    assert refused.tolist() == [True, True, False, False, False, True, True, True, True]
    assert "A step counts as proved up to 1e-12 of its time outside of 3 s." in header(on_window(), "axis")
    assert not values[refused].any()
    refused, _ = run(compiled(periodic(), tmp_path), np.array([-2001.0, 2.0**41, -(2.0**42), 2.3e12]))
    assert refused.tolist() == [False, False, True, True]


def test_arithmetic_that_is_not_certified_does_not_compile(tmp_path: Path) -> None:
    (tmp_path / "a.c").write_text(header(on_window(), "axis"), encoding="utf-8")
    for option, works in (("-O3", True), ("-ffast-math", False)):
        command = [str(CC), *STRICT, option, "-fsyntax-only", "a.c"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode == 0) == works, done.stderr
    assert "certified for IEEE double precision without fast-math" in done.stderr


def test_of_inputs_that_act_alike_the_smallest_is_given(tmp_path: Path) -> None:
    system, input_set = random_case(0)
    n = len(system.states)
    plant = ConstrainedSystem(system, Polytope.box([-99] * n, [99] * n), input_set)
    kernel = SquaredExponential(0.6, 0.5)
    reference = Reference(tuple(random_sum(kernel) for _ in range(plant.signal_count)), plant)
    _, values = run(compiled(stub(reference), tmp_path), TIMES)
    expected = reference.input_at(TIMES)
    np.testing.assert_allclose(values[:, n:], expected, atol=1e-9)
    assert plant.allocation is not None
    unchanged = np.stack([q([z.summed for z in reference.kernel_sums], TIMES) for q in plant.flatness.inputs], axis=-1)
    assert np.any(np.abs(expected - unchanged) > 1e-3), "another input than that of the signals is smallest somewhere"
