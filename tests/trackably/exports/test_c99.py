"""Headers in C compile without a warning, and what they compute is within the bound that the certificate names."""

import subprocess
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.splines.naive import quantity_at
from tests.trackably.exports.c_programs import CC, STRICT, compiled, run
from tests.trackably.exports.certified import require_within_certified_errors
from tests.trackably.exports.references import nonlinear, on_window, periodic, robot
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
from trackably.certificates.draft import evaluation_errors
from trackably.certificates.form import encode_subject
from trackably.checker.certificate import Cover, Window
from trackably.checker.form import subject_of
from trackably.checker.piecewise import evaluation_errors as errors_of_pieces
from trackably.exports.c99 import header
from trackably.exports.proved import Proved
from trackably.gp.signal import KernelSum
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.reference import Reference

pytestmark = pytest.mark.skipif(CC is None, reason="there is no C compiler")

RNG = np.random.default_rng(5)
KERNELS: dict[str, Kernel] = {
    "rational_quadratic": RationalQuadratic(0.7, 0.31, 1.3),
    "piecewise_polynomial_2": PiecewisePolynomial2(0.7, 0.9),
    "product_of_a_sum": (Periodic(1.1, 0.9, 1.7) + Matern52(1.3, 0.31)) * SquaredExponential(1.2, 1.4),
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


def random_sum(kernel: Kernel) -> KernelSum:
    centres = np.sort(RNG.uniform(0, 4, 9))
    return KernelSum(kernel, 0.125, centres, RNG.standard_normal(9))


TIMES = np.concatenate([RNG.uniform(-2, 6, 6), [0.0, 0.5, 1.0, 4.0]])


def spline(times: Array, beyond: str) -> PolynomialPieces:
    """Cubic pieces that meet."""
    values = np.append(RNG.standard_normal(len(times) - 1), 0.0)
    return PolynomialPieces(times, CubicSpline(times, values, bc_type="natural").c[::-1].T, beyond)


def steps(times: list[float], beyond: str) -> PolynomialPieces:
    """Lines that do not meet."""
    return PolynomialPieces(times, RNG.standard_normal((len(times) - 1, 2)), beyond)


NEAR_STEPS = [0.0, 0.35, 0.6000000000000001, 1.45, 4.0]
"""Breakpoints that are near to multiples of the sampling time."""
PIECES = {
    "spline_period": spline(np.linspace(0.0, 4.0, 9), "period"),
    "steps_rest": steps(NEAR_STEPS, "rest"),
    "steps_period": steps([0.0, 0.1, 0.15000000000000002, 0.3], "period"),
    "steps_end": steps(NEAR_STEPS, "end"),
}
WIDE = ConstrainedSystem(AXIS.system, Polytope.box([-1e4, -1e4], [1e4, 1e4]), Polytope.box([-1e4], [1e4]))


def redundant() -> Proved:
    """Of inputs that act alike, the smallest is given."""
    system, input_set = random_case(0)
    n = len(system.states)
    plant, kernel = (
        ConstrainedSystem(system, Polytope.box([-99] * n, [99] * n), input_set),
        SquaredExponential(0.6, 0.5),
    )
    return stub(Reference(tuple(random_sum(kernel) for _ in range(plant.signal_count)), plant))


@cache
def exported() -> dict[str, Proved]:
    return {
        **{name: stub(Reference((random_sum(kernel),), AXIS)) for name, kernel in KERNELS.items()},
        **{name: stub(Reference((pieces,), WIDE)) for name, pieces in PIECES.items()},
        **{of.__name__: of() for of in (redundant, robot, nonlinear, on_window, periodic)},
    }


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One program for all references."""
    return compiled(exported(), tmp_path_factory.mktemp("c"))


WITHIN = {**dict.fromkeys(KERNELS, TIMES), "robot": 7 * TIMES - 14, "nonlinear": np.append(0.37 * np.arange(8), 0.2)}


@pytest.mark.parametrize("name", WITHIN)
def test_values_are_within_the_certified_error(name: str, program: Path) -> None:
    proved, times = exported()[name], WITHIN[name]
    refused, values = run(program, f"{name}_at", times)
    assert not refused.any()
    assert max(proved.certificate.evaluation_error.values()) < 1e-6
    require_within_certified_errors(proved, map(Fraction, times.tolist()), values)


def test_a_square_is_a_product(tmp_path: Path) -> None:
    assert "pow(" not in nonlinear().to_c(tmp_path / "tank.h", "tank").read_text()


@pytest.mark.parametrize("name", PIECES)
def test_values_of_polynomial_pieces_are_within_the_certified_error(name: str, program: Path) -> None:
    proved, pieces = exported()[name], PIECES[name]
    reference = proved.reference
    ends = pieces.breakpoints[:-1] + (np.arange(-6, 20)[:, None] * pieces.period if pieces.beyond == "period" else 0.0)
    times = np.concatenate([TIMES, *(of.ravel() for of in (ends, np.nextafter(ends, 99), np.nextafter(ends, -99)))])
    first, last = (0.0, 3.85) if pieces.beyond == "end" else (-2.0, 6.0)
    times, k = times[(first <= times) & (times < last)], np.arange(76)
    (refused, values), (late, at_steps) = run(program, f"{name}_at", times), run(program, f"{name}_step", k)
    assert not np.append(refused, late).any()
    require_nearest(proved, [*map(Fraction, times.tolist())], values)
    require_nearest(proved, [i * Fraction(WIDE.sampling_time) for i in k.tolist()], at_steps)
    np.testing.assert_allclose(at_steps, np.hstack([reference.state(k), reference.input(k)]), rtol=3e-16, atol=1e-25)


def require_nearest(proved: Proved, times: list[Fraction], values: Array) -> None:
    """Values are those of rational arithmetic, rounded once, and within the bound of the certificate."""
    flatness = proved.reference.plant.flatness
    for name, coordinate, column in zip(AXIS.names, (*flatness.states, *flatness.inputs), values.T, strict=True):
        error = Fraction(proved.certificate.evaluation_error[name])
        for t, value in zip(times, column.tolist(), strict=True):
            exact = quantity_at(coordinate.functional, proved.reference.pieces, t)
            assert abs(exact - Fraction(value)) <= min(error, abs(exact) / 2**52 + Fraction(1, 10**25))


def test_times_that_are_not_proved_are_refused_as_in_python(program: Path) -> None:
    times = np.array([-1e-9, -1.0, 0.0, 1.5, 3.0, np.nextafter(3.0, 4.0), 3.0 * (1 + 5e-13), 1e9, np.inf])
    refused, values = run(program, "on_window_at", times)
    assert refused.tolist() == [True, True, False, False, False, True, True, True, True]
    assert "A step counts as proved up to 1e-12 of its time outside of 3 s." in header(on_window(), "axis")
    assert not values[refused].any()
    refused, _ = run(program, "periodic_at", np.array([-2001.0, 2.0**41, -(2.0**42), 2.3e12]))
    assert refused.tolist() == [False, False, True, True]


def test_arithmetic_that_is_not_certified_does_not_compile(tmp_path: Path) -> None:
    (tmp_path / "a.c").write_text(header(on_window(), "axis"), encoding="utf-8")
    for option, works in (("-O3", True), ("-ffast-math", False)):
        command = [str(CC), *STRICT, option, "-fsyntax-only", "a.c"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert (done.returncode == 0) == works, done.stderr
    assert "certified for IEEE double precision without fast-math" in done.stderr


def test_of_inputs_that_act_alike_the_smallest_is_given(program: Path) -> None:
    reference = exported()["redundant"].reference
    _, values = run(program, "redundant_at", TIMES)
    plant, expected = reference.plant, reference.input_at(TIMES)
    np.testing.assert_allclose(values[:, len(plant.system.states) :], expected, atol=1e-9)
    unchanged = np.stack([q([z.summed for z in reference.kernel_sums], TIMES) for q in plant.flatness.inputs], axis=-1)
    assert np.any(np.abs(expected - unchanged) > 1e-3), "another input than that of the signals is smallest somewhere"


def test_an_angle_is_named() -> None:
    assert "x[2] heading, an angle in (-pi, pi]: add whole turns" in header(exported()["robot"], "robot")
