"""Bounds that move in time: verdicts agree with a dense search in many digits, and what is tampered with is refused."""

import copy
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from tests.trackably.certificates import naive
from trackably import (
    Controller,
    Infeasible,
    Plan,
    Samples,
    TubeController,
    Zonotope,
    learn_reference,
    tank,
)
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import as_written, encode_certificate, encode_counterexample
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove, prove_at_instants, prove_on_window
from trackably.checker import Failed, Proved, Refuted, check
from trackably.files import from_json, to_json
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.pieces import PolynomialPieces
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.written import set_of

T, END = 0.05, 4.0
AXIS = LinearSystem([[1, T], [0, 1]], [[T**2 / 2], [T]], T)
SCALAR = LinearSystem([[0.9]], [[0.5]], T)


def as_read(found: Certificate | Counterexample) -> dict:
    """What a file says."""
    encode = encode_certificate if isinstance(found, Certificate) else encode_counterexample
    return from_json(to_json(encode(found)))


def with_upper(data: dict, change: dict) -> dict:
    """The file with another upper bound of the state."""
    other = copy.deepcopy(data)
    other["reference"]["plant"]["state_set"]["upper"][0].update(change)
    return other


def signal(rng: np.random.Generator, count: int = 8) -> KernelSum:
    return KernelSum(SquaredExponential(0.4, 0.5), 0.0, np.linspace(0, END, count), rng.standard_normal(count))


def near(rng: np.random.Generator, z, sign: int) -> PolynomialPieces:
    """Polynomials that follow z in pieces, at a distance that jumps: some are broken."""
    ends = np.concatenate([[0.0], np.sort(rng.uniform(0.3, END - 0.3, int(rng.integers(1, 4)))), [END]])
    pieces = []
    for a, b in pairwise(ends):
        t = np.linspace(0, b - a, 12)
        shape = np.polynomial.polynomial.polyfit(t, z(a + t), int(rng.integers(0, 4)))
        away = np.max(sign * (z(a + t) - np.polynomial.polynomial.polyval(t, shape)))
        shape[0] += sign * (away + rng.choice([0.5, 0.05, 1e-2, -1e-3], p=[0.4, 0.3, 0.2, 0.1]))
        pieces.append(np.pad(shape, (0, 4 - len(shape))))
    return PolynomialPieces(ends, pieces)


def problem(seed: int) -> Reference:
    rng = np.random.default_rng(seed)
    z = signal(rng)
    system = (AXIS, SCALAR)[seed % 2]
    n = len(system.states)
    free = Reference((z,), ConstrainedSystem(system, Polytope.box([-9.0] * n, [9.0] * n), Polytope.box(-1e4, 1e4)))

    def of_state(t):
        return free.quantities[0]((z,), t)

    x = Polytope.box(
        [near(rng, of_state, -1) if seed % 3 else -5.0, *[-90.0] * (n - 1)], [near(rng, of_state, 1), *[90.0] * (n - 1)]
    )
    return Reference((z,), ConstrainedSystem(system, x, Polytope.box(-1e4, 1e4)))


def sides(end, t: float, low: bool):
    """The values that hold before and from a time on, in many digits; the tighter one."""
    if not isinstance(end, PolynomialPieces):
        return mp.mpf(end)
    ends, found = end.breakpoints.tolist(), []
    for i, piece in enumerate(end.coefficients.tolist()):
        if ends[i] <= t <= ends[i + 1]:
            found.append(mp.fsum(mp.mpf(c) * (mp.mpf(t) - mp.mpf(ends[i])) ** k for k, c in enumerate(piece)))
    return max(found) if low else min(found)


def least_margin(reference: Reference):
    """The smallest distance to a bound that a dense search finds, in many digits."""
    name, (_, bounds) = reference.quantities[0].name, reference.plant.state_set.intervals[0]
    low, high = bounds.low, bounds.high

    def margin(t: float):
        value = naive.exactly(reference, name, t)
        return min(value - sides(low, t, True), sides(high, t, False) - value)

    with mp.workdps(naive.DIGITS):
        grid = np.union1d(np.linspace(0, END, 401), bounds.breakpoints)
        coarse = reference.quantities[0].margin(reference.signals, grid)
        near = [
            t
            for i in np.argsort(coarse)[:6]
            for t in np.linspace(grid[max(i - 1, 0)], grid[min(i + 1, len(grid) - 1)], 41)
        ]
        return min(map(margin, [*near, *bounds.breakpoints.tolist()]))


def test_verdicts_on_random_bounds_agree_with_a_dense_search() -> None:
    said = Counter[type]()
    for seed in range(14):
        reference = problem(seed)
        found, least = prove_on_window(reference, 0.0, END), least_margin(reference)
        said[type(found)] += 1
        if isinstance(found, Certificate):
            assert least >= 0, seed
            assert isinstance(check(as_read(found), exact=seed % 4 == 0), Proved)
        elif isinstance(found, Counterexample):
            assert least <= -found.violation, seed
            assert isinstance(check(as_read(found)), Refuted)
        else:
            assert abs(least) < 1e-9, (seed, found.explanation)
    assert min(said[Certificate], said[Counterexample]) >= 5, said


HILL = KernelSum(SquaredExponential(1.0, 0.5), 0.0, np.array([1.0]), np.array([0.4]))
"""It is 0.4 at 1 s, 0.243 at 1.5 s, and falls to 0.054 at 2 s."""


def of_hill(upper, lower=-1.0) -> Reference:
    return Reference((HILL,), ConstrainedSystem(SCALAR, Polytope.box([lower], [upper]), Polytope.box(-9.0, 9.0)))


def proved(upper=None, prover=lambda reference: prove_on_window(reference, 0.0, END), lower=-1.0):
    upper = PolynomialPieces.steps({0.0: 0.5, 2.0: 0.1}) if upper is None else upper
    found = prover(of_hill(upper, lower))
    assert isinstance(found, Certificate), found
    return as_read(found)


def test_each_side_of_a_jump_counts() -> None:
    at = float(HILL(np.asarray(2.0)))
    before = PolynomialPieces([0, 1.9, 2, 3], [[0.5, 0], [0.5, (at - 1e-6 - 0.5) / 0.1], [0.5, 0]])
    for upper in (before, PolynomialPieces.steps({0.0: 0.5, 2.0: at - 1e-6})):
        found = prove_on_window(of_hill(upper), 0.0, END)
        assert isinstance(found, Counterexample), found
    assert proved(PolynomialPieces.steps({0.0: 0.5, 2.0: at + 1e-6}))


@pytest.mark.parametrize("exact", [False, True])
def test_what_is_tampered_with_is_refused(exact: bool) -> None:
    data = proved()
    assert isinstance(check(data, exact=exact), Proved)

    def changed(change) -> bool:
        other = copy.deepcopy(data)
        change(other, other["reference"]["plant"]["state_set"]["upper"][0])
        return not isinstance(check(other, exact=exact), Proved)

    def over_breakpoint(other, _):
        cover = other["claim"]["covers"]["state"]
        at = cover["ends"].index(2.0)
        del cover["ends"][at], cover["radii"][at]

    assert changed(over_breakpoint)
    assert changed(lambda _, end: end["breakpoints"].__setitem__(1, 1.4))
    assert changed(lambda _, end: end["coefficients"][1].__setitem__(0, 0.05))
    assert changed(lambda _, end: end["coefficients"][0].__setitem__(0, 0.39))
    assert changed(lambda _, end: end["coefficients"].__setitem__(0, [0.5, -0.3]))
    assert changed(lambda _, end: end.update(beyond="end"))
    assert changed(lambda _, end: end.update(breakpoints=[0.0, 2.0, 2.0]))
    assert changed(lambda _, end: end["breakpoints"].append(5.0))
    assert changed(lambda other, end: other["reference"]["plant"]["state_set"]["lower"].__setitem__(0, end))


def test_claims_of_all_times_compare_the_tail_with_where_bounds_rest() -> None:
    data = proved(PolynomialPieces.lines({0.0: 0.5, 1.5: 0.45, 3.0: 0.2, 30.0: 0.1}), prove)
    assert data["claim"]["tail_start"] >= 30.0
    for change in (
        {"breakpoints": [0.0, 1.5, 3.0, 60.0]},
        {"beyond": "period"},
        {"coefficients": [[0.5], [0.5], [-0.1]]},
    ):
        assert isinstance(check(with_upper(data, change)), Failed)
    assert isinstance(prove(of_hill(PolynomialPieces.steps({0.0: 0.5, 50.0: -0.01}))), Counterexample)
    assert proved(PolynomialPieces.steps({0.0: 0.5, 2.0: 0.1}), prove_at_instants)
    assert not isinstance(prove_at_instants(of_hill(PolynomialPieces.steps({0.0: 0.5, 1.5: 0.2}))), Certificate)


def test_all_phases_need_bounds_of_the_same_period() -> None:
    swing = KernelSum(Periodic(1.0, 1.0, 2.0), 0.0, np.array([0.5]), np.array([0.4]))

    def of(upper) -> Reference:
        return Reference((swing,), ConstrainedSystem(SCALAR, Polytope.box([-1.0], [upper]), Polytope.box(-9.0, 9.0)))

    low, high = (float(swing(np.asarray(t))) for t in (1.5, 0.5))
    fits = PolynomialPieces.lines({0.0: high, 0.5: high + 0.01, 1.5: low + 0.1}, period=2.0)
    found = prove(of(fits))
    assert isinstance(found, Certificate), found
    data = as_read(found)
    assert isinstance(check(data), Proved)
    for change in ({"beyond": "rest"}, {"breakpoints": [0.0, 0.5, 1.5, 2.5]}):
        assert isinstance(check(with_upper(data, change)), Failed)
    late = PolynomialPieces.lines({0.0: low + 0.1, 0.5: low + 0.2, 1.5: high}, period=2.0)
    assert isinstance(prove(of(late)), Counterexample)


def test_an_end_that_moves_is_no_constant() -> None:
    moving = Polytope.box([-1.0], [PolynomialPieces.steps({0.0: 0.5, 1.0: 0.25})])
    for read in (lambda: moving.lower, lambda: moving.intervals[0][1].upper, lambda: moving.inequalities):
        with pytest.raises(ValueError, match="constant"):
            read()


T_LEARNED = np.arange(25) / 5
LEARNED: dict[str, tuple] = {
    "all_times": (
        SquaredExponential(),
        PolynomialPieces.lines({0.0: 0.1, 2.4: 0.6, 3.2: 0.05, 4.8: 0.4}),
        0.45 * np.sin(1.6 * T_LEARNED),
    ),
    "all_phases": (
        Periodic(period=4.0),
        PolynomialPieces.steps({0.0: 0.35, 1.0: 0.29}, 4.0),
        0.3 * np.sin(np.pi / 2 * T_LEARNED),
    ),
}


@pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning")
@pytest.mark.parametrize("claim", LEARNED)
def test_what_is_learned_keeps_bounds_that_move(claim) -> None:
    kernel, upper, values = LEARNED[claim]
    plant = ConstrainedSystem(SCALAR, Polytope.box([-1.0], [upper]), Polytope.box(-1.0, 1.0))
    learned = learn_reference(Samples(T_LEARNED, values), plant, kernel, claim, noise_std=0.02, progress=False)
    times = np.linspace(0, 12, 2001)
    assert min(learned.reference.quantities[0].margin(learned.reference.signals, times)) >= 0
    assert any(bound.name == "state" for bound in learned.fit.active_bounds)
    if claim == "all_times":
        with pytest.raises(ValueError, match="period"):
            learn_reference(Samples(T_LEARNED, values), plant, Periodic(period=6.0), "all_phases", noise_std=0.02)


def test_disturbed_systems_keep_bounds_that_move() -> None:
    t = np.linspace(0, 6, 13)
    upper = PolynomialPieces.steps({0.0: 0.2, 2.5: 0.5})
    plant = ConstrainedSystem(SCALAR, Polytope.box([-1.0], [upper]), Polytope.box(-1.0, 1.0))
    samples, W = Samples(t, 0.1 * np.sin(t)), Zonotope.box([-0.004], [0.004])
    learned = learn_reference(
        samples, plant, SquaredExponential(), (0.0, 6.0), noise_std=0.02, progress=False, disturbance=W
    )
    data = as_read(learned.certificate)
    assert isinstance(check(data), Proved)
    left = data["reference"]["plant"]["state_set"]["upper"][0]["coefficients"]
    given = data["disturbance"]["state_set"]["upper"][0]["coefficients"]
    assert all(a[0] < b[0] for a, b in zip(left, given, strict=True))
    for change in (
        lambda of: of["coefficients"][0].__setitem__(0, left[0][0]),
        lambda of: of["breakpoints"].__setitem__(1, 2.0),
        lambda of: of.update(beyond="period"),
    ):
        other = copy.deepcopy(data)
        change(other["disturbance"]["state_set"]["upper"][0])
        assert isinstance(check(other), Failed)


def test_splines_of_scipy_and_tables_stand_for_what_they_say() -> None:
    at, heights = [0.0, 1.0, 3.0], [0.2, 0.6, 0.2]
    smooth = CubicSpline(at, heights, bc_type="periodic")
    for given in (smooth, PPoly.from_spline(make_interp_spline(at, heights, k=1))):
        bounds = Polytope.box([-1.0], [given]).intervals[0][1]
        t = np.linspace(0.0, 2.99, 40)
        np.testing.assert_allclose(bounds.ends(t)[1], given(t), rtol=1e-12)
        later = 4.0 if given is smooth else 3.0  # it repeats, or rests
        np.testing.assert_allclose(bounds.ends(np.array([4.0]))[1], given(later), rtol=1e-12)
    steps = {0.0: 0.5, 2.5: 0.25}
    for made in (Polytope.box([-1.0], [steps]), Polytope.box(-1.0, steps), Polytope([[1.0]], [-1.0], [steps])):
        assert as_written(made) == as_written(Polytope.box([-1.0], [PolynomialPieces.steps(steps)]))
    with pytest.raises(ValueError, match="one value of a spline at a time"):
        Polytope.box([-1.0], [CubicSpline(at, np.ones((3, 2)))])


def test_files_write_steps_and_lines() -> None:
    for written, wanted in (
        ({0.0: 0.5, 2.5: 0.25}, PolynomialPieces.steps({0.0: 0.5, 2.5: 0.25})),
        ({"lines": {"0": 0.5, "2.5": 0.25}}, PolynomialPieces.lines({0.0: 0.5, 2.5: 0.25})),
        ({"steps": {0: 1, 1: 2}, "period": 3}, PolynomialPieces.steps({0.0: 1.0, 1.0: 2.0}, period=3.0)),
    ):
        box = set_of({"lower": [-1.0], "upper": [written]})
        assert as_written(box) == as_written(Polytope.box([-1.0], [wanted]))
    for wrong in (
        {},
        {"lines": 1.0},
        {"steps": {0: 1}, "lines": {0: 1}},
        {1.0: 0.5, 0.0: 0.2},
        {"lines": {0: 1}, "x": 1},
    ):
        with pytest.raises(ValueError, match=r"expected|rising"):
            PolynomialPieces.from_mapping(wrong)


def spline(upper, beyond="rest", pieces=None) -> Reference:
    z = PolynomialPieces([0.0, 1.0, 2.0], pieces or [[0.0, 0.4, 0.0], [0.4, -0.4, 0.0]], beyond)
    return Reference((z,), ConstrainedSystem(SCALAR, Polytope.box([-1.0], [upper]), Polytope.box(-9.0, 9.0)))


@pytest.mark.parametrize("exact", [False, True])
def test_polynomial_pieces_keep_bounds_that_move(exact: bool) -> None:
    tent = PolynomialPieces.lines({0.0: 0.01, 1.0: 0.41, 2.0: 0.01})
    for reference, prover in ((spline(tent), prove), (spline(tent), lambda of: prove_on_window(of, 0.0, 2.0))):
        found = prover(reference)
        assert isinstance(found, Certificate), found
        data = as_read(found)
        assert isinstance(check(data, exact=exact), Proved)
        for change in ({"breakpoints": [0.0, 0.9, 2.0]}, {"coefficients": [[0.01, 0.38], [0.41, -0.4]]}):
            assert isinstance(check(with_upper(data, change), exact=exact), Failed)
    periodic = PolynomialPieces.lines({0.0: 0.01, 1.0: 0.41}, period=2.0)
    assert isinstance(prove(spline(periodic, "period")), Certificate)
    assert not isinstance(
        prove(spline(PolynomialPieces.lines({0.0: 0.3, 1.0: 0.41}, period=3.0), "period")), Certificate
    )
    for low in (
        PolynomialPieces.steps({0.0: 0.5, 0.5: 0.399}),
        PolynomialPieces.lines({0.0: 0.01, 1.0: 0.39, 2.0: 0.5}),
    ):
        broken = prove(spline(low))
        assert isinstance(broken, Counterexample)
        assert isinstance(check(as_read(broken), exact=exact), Refuted)


@pytest.mark.parametrize("disturbed", [False, True])
def test_controllers_keep_the_bounds_of_each_step(disturbed: bool) -> None:
    upper, push = PolynomialPieces.steps({0.0: 0.3, 0.5: 0.12}), PolynomialPieces.lines({0.0: 0.2, 1.0: 0.6})
    plant = ConstrainedSystem(SCALAR, Polytope.box([-1.0], [upper]), Polytope.box(-1.0, push))
    t = np.linspace(0, 2, 9)
    learned = learn_reference(
        Samples(t, 0.1 * np.sin(t)), plant, SquaredExponential(), (0.0, 2.0), noise_std=0.02, progress=False,
        disturbance=Zonotope.box([-0.002], [0.002]) if disturbed else None,
    )  # fmt: skip
    control = TubeController(learned.tightening, 8) if disturbed else Controller(plant, 8)
    kept = control.plant if not disturbed else learned.tightening.plant
    for start in (-0.4, 0.11, 0.25):
        x = np.array([start])
        for k in range(20):
            plan = control.step(k, x, learned)
            if not isinstance(plan, Plan):
                assert start > 0.2  # it does not come down in time
                assert isinstance(plan, Infeasible)
                break
            for i in range(1, 9):
                assert kept.state_set.at((k + i) * T).margin(plan.states[i]) >= -1e-6
                assert kept.input_set.at((k + i - 1) * T).margin(plan.inputs[i - 1]) >= -1e-6
            assert plant.input_set.at(k * T).margin(plan.input) >= 0
            x = SCALAR.A @ x + SCALAR.B @ plan.input
    with pytest.raises(ValueError, match="nonlinear"):
        Controller(ConstrainedSystem(tank(1.0), Polytope.box([0.1], [upper]), Polytope.box(0.0, 1.0)), 4)
