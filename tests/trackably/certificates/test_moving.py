"""Bounds that move in time: verdicts agree with a dense search in many digits, and what is tampered with is refused."""

import copy
from collections import Counter
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from mpmath import mp
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from tests.splines.naive import value_of
from tests.trackably.certificates import naive
from tests.trackably.certificates.decoded import as_read
from trackably import (
    Controller,
    Plan,
    Samples,
    TrackableReference,
    TubeController,
    Zonotope,
    learn_reference,
)
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import as_written
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove
from trackably.checker import Failed, Proved, Refuted, check
from trackably.checker.certificate import Instants, Window
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
    z = KernelSum(SquaredExponential(0.4, 0.5), 0.0, np.linspace(0, END, 8), rng.standard_normal(8))
    system = (AXIS, SCALAR)[seed % 2]
    n = len(system.states)
    free = Reference((z,), ConstrainedSystem(system, Polytope.box([-9.0] * n, [9.0] * n), Polytope.box(-1e4, 1e4)))

    def of_state(t):
        return free.quantities[0]((z,), t)

    x = Polytope.box(
        [near(rng, of_state, -1) if seed % 3 else -5.0, *[-90.0] * (n - 1)], [near(rng, of_state, 1), *[90.0] * (n - 1)]
    )
    return Reference((z,), replace(free.plant, state_set=x))


def tighter(end, t: float, choose):
    """The chosen one of the values that hold before and from a time on, in many digits."""
    if not isinstance(end, PolynomialPieces):
        return mp.mpf(end)
    values = (value_of(end, Fraction(t), before) for before in (True, False))
    return choose(mp.mpf(value.numerator) / value.denominator for value in values)


def least_margin(reference: Reference):
    """The smallest distance to a bound that a dense search finds, in many digits."""
    name, bounds = reference.quantities[0].name, reference.plant.state_set.bounds[0]

    def margin(t: float):
        value = naive.exactly(reference, name, t)
        return min(value - tighter(bounds.low, t, max), tighter(bounds.high, t, min) - value)

    with mp.workdps(naive.DIGITS):
        grid = np.union1d(np.linspace(0, END, 401), bounds.breakpoints)
        coarse = reference.quantities[0].margin(reference.signals, grid)
        around = [grid[[max(i - 1, 0), min(i + 1, len(grid) - 1)]] for i in np.argsort(coarse)[:3]]
        return min(map(margin, [*np.linspace(*np.transpose(around), 21).ravel(), *bounds.breakpoints]))


def test_verdicts_on_random_bounds_agree_with_a_dense_search() -> None:
    said = Counter[type]()
    for seed in range(24):
        reference = problem(seed)
        found, least = prove(reference, Window(0.0, END)), least_margin(reference)
        said[type(found)] += 1
        if isinstance(found, Certificate):
            assert least >= 0, seed
            assert isinstance(check(as_read(found), exact=seed == 0), Proved)
        elif isinstance(found, Counterexample):
            assert least <= -found.violation, seed
        else:
            assert abs(least) < 1e-9, (seed, found.explanation)
    assert min(said[Certificate], said[Counterexample]) >= 5, said


HILL = KernelSum(SquaredExponential(1.0, 0.5), 0.0, np.array([1.0]), np.array([0.4]))
"""It is 0.4 at 1 s, 0.243 at 1.5 s, and falls to 0.054 at 2 s."""


def under(upper, z=HILL) -> Reference:
    """z with an upper bound that moves."""
    return Reference((z,), ConstrainedSystem(SCALAR, Polytope.box([-1.0], [upper]), Polytope.box(-9.0, 9.0)))


def on_window(reference: Reference) -> Certificate | Counterexample:
    return prove(reference, Window(0.0, END))


def test_each_side_of_a_jump_counts() -> None:
    at = float(HILL(np.asarray(2.0)))
    before = PolynomialPieces([0, 1.9, 2, 3], [[0.5, 0], [0.5, (at - 1e-6 - 0.5) / 0.1], [0.5, 0]])
    again = PolynomialPieces.steps({0.0: 0.3, 0.1: 0.2}, period=0.3)
    pulse = PolynomialPieces([0.0, 0.69, 0.71, 3.0], [[0.0], [0.4], [0.0]])  # outside on both sides of a later jump
    for upper, z in (before, HILL), (PolynomialPieces.steps({0.0: 0.5, 2.0: at - 1e-6}), HILL), (again, pulse):
        found = on_window(under(upper, z))
        assert isinstance(found, Counterexample), found
    assert isinstance(on_window(under(PolynomialPieces.steps({0.0: 0.5, 2.0: at + 1e-6}))), Certificate)
    assert "error of float64" in on_window(under(PolynomialPieces.steps({0.0: 0.5, 2.0: at}))).explanation


STEPPED = PolynomialPieces.steps({0.0: 0.5, 2.0: 0.1})
RESTING = PolynomialPieces.lines({0.0: 0.5, 1.5: 0.45, 3.0: 0.2, 30.0: 0.1})
SWING = KernelSum(Periodic(1.0, 1.0, 2.0), 0.0, np.array([0.5]), np.array([0.4]))
LOW, HIGH = (float(SWING(np.asarray(t))) for t in (1.5, 0.5))
FITTING = PolynomialPieces.lines({0.0: HIGH, 0.5: HIGH + 0.01, 1.5: LOW + 0.1}, period=2.0)
TENT = PolynomialPieces.lines({0.0: 0.01, 1.0: 0.41, 2.0: 0.01})
JOLTED = {0.0: 0.2, 2.5: 0.5}


def curve(beyond="rest") -> PolynomialPieces:
    return PolynomialPieces([0.0, 1.0, 2.0], [[0.0, 0.4, 0.0], [0.4, -0.4, 0.0]], beyond)


def plant_with(upper, push=1.0) -> ConstrainedSystem:
    return ConstrainedSystem(SCALAR, Polytope.box([-1.0], [upper]), Polytope.box(-1.0, push))


def learned(plant: ConstrainedSystem, claim, end: float, values=lambda t: 0.1 * np.sin(t), **options):
    """What is learned from samples of a curve until its `end` [s]."""
    given = {"kernel": SquaredExponential(), "noise_std": 0.02, "progress": False} | options
    t = np.linspace(0, end, 13)
    return learn_reference(Samples(t, values(t)), plant, claim=claim, **given)


def pushed(plant: ConstrainedSystem, end: float, by: float) -> TrackableReference:
    return learned(plant, (0.0, end), end, disturbance=Zonotope.box([-by], [by]))


CERTIFIED = {
    "a window": lambda: on_window(under(STEPPED)),
    "all times": lambda: prove(under(RESTING)),
    "all phases": lambda: prove(under(FITTING, SWING)),
    "instants": lambda: prove(under(STEPPED), Instants()),
    "a disturbed system": lambda: pushed(plant_with(PolynomialPieces.steps(JOLTED)), 6.0, 0.004).certificate,
    "pieces": lambda: prove(under(TENT, curve())),
    "a window of pieces": lambda: prove(under(TENT, curve()), Window(0.0, 2.0)),
    "pieces that repeat": lambda: prove(
        under(PolynomialPieces.lines({0.0: 0.01, 1.0: 0.41}, period=2.0), curve("period"))
    ),
}


@cache
def certified(name: str) -> dict:
    found = CERTIFIED[name]()
    assert isinstance(found, Certificate), found
    return as_read(found)


def test_no_box_covers_a_breakpoint() -> None:
    data = copy.deepcopy(certified("a window"))
    cover = data["claim"]["covers"]["state"]
    at = cover["ends"].index(2.0)
    del cover["ends"][at], cover["radii"][at]
    assert isinstance(check(data), Failed)


BROKEN = {
    "late": lambda: prove(under(PolynomialPieces.steps({0.0: 0.5, 50.0: -0.01}))),
    "at an instant": lambda: prove(under(PolynomialPieces.steps({0.0: 0.5, 1.5: 0.2})), Instants()),
    "in a phase": lambda: prove(
        under(PolynomialPieces.lines({0.0: LOW + 0.1, 0.5: LOW + 0.2, 1.5: HIGH}, period=2.0), SWING)
    ),
    "by a curve that steps down": lambda: prove(under(PolynomialPieces.steps({0.0: 0.5, 0.5: 0.399}), curve())),
    "by a curve": lambda: prove(under(PolynomialPieces.lines({0.0: 0.01, 1.0: 0.39, 2.0: 0.5}), curve())),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_bound_that_is_broken_is_refuted(name: str) -> None:
    found = BROKEN[name]()
    assert isinstance(found, Counterexample), found
    assert all(isinstance(check(as_read(found), exact=exact), Refuted) for exact in (False, True))


LEARNED: dict[object, tuple] = {
    "all_times": (
        SquaredExponential(),
        plant_with(PolynomialPieces.lines({0.0: 0.1, 2.4: 0.6, 3.2: 0.05, 4.8: 0.4})),
        lambda t: 0.45 * np.sin(1.6 * t),
    ),
    "all_phases": (
        Periodic(period=4.0),
        plant_with(PolynomialPieces.steps({0.0: 0.35, 1.0: 0.29}, 4.0)),
        lambda t: 0.3 * np.sin(np.pi / 2 * t),
    ),
    (0.0, 4.8): (  # slowly for a while
        SquaredExponential(),
        ConstrainedSystem(AXIS, Polytope.box([-1.0, -1.0], [5.0, {0.0: 1.0, 2.0: 0.4, 3.0: 1.0}]), Polytope.box(-9, 9)),
        lambda t: 0.5 * t,
    ),
}


@pytest.mark.filterwarnings("ignore::trackably.IgnoresSamplesWarning", "ignore::trackably.DoubtfulInputWarning")
@pytest.mark.parametrize("claim", LEARNED)
def test_what_is_learned_keeps_bounds_that_move_and_nearly_touches_them(claim) -> None:
    kernel, plant, values = LEARNED[claim]
    found = learned(plant, claim, 4.8, values, kernel=kernel)
    moving = found.reference.quantities[len(plant.names) - 2]
    margins = moving.margin(found.reference.signals, np.linspace(0, 4.8, 2001))
    assert 0 <= min(margins) < 1e-3
    assert any(bound.name == moving.name for bound in found.fit.active_bounds)
    assert "which moves in time" in found._repr_html_()


def test_bounds_of_another_period_are_not_repeated() -> None:
    upper = PolynomialPieces.lines({0.0: 0.3, 1.0: 0.41}, period=3.0)
    with pytest.raises(ValueError, match="period"):
        learned(plant_with(upper), "all_phases", 4.8, kernel=Periodic(period=4.0))


AT, HEIGHTS = [0.0, 1.0, 3.0], [0.2, 0.6, 0.2]
SMOOTH = CubicSpline(AT, HEIGHTS, bc_type="periodic")


@pytest.mark.parametrize(
    "given", [STEPPED, SMOOTH, CubicSpline(AT, HEIGHTS), PPoly.from_spline(make_interp_spline(AT, HEIGHTS, k=1))]
)
def test_steps_and_splines_of_scipy_are_bounds_that_repeat_or_rest(given) -> None:
    bounds = Polytope.box([-1.0], [given]).bounds[0]
    t = np.linspace(0.0, 2.5, 26)
    np.testing.assert_allclose(bounds.ends(t)[1], given(t), rtol=1e-12)
    np.testing.assert_allclose(bounds.ends(np.array([4.0]))[1], given(4.0 if given is SMOOTH else 3.0), rtol=1e-12)


STEPS = {0.0: 0.5, 2.5: 0.25}
WRITTEN = [
    (STEPS, PolynomialPieces.steps(STEPS)),
    ({"lines": {"0": 0.5, "2.5": 0.25}}, PolynomialPieces.lines(STEPS)),
    ({"lines": {0: 1, 1: 2, 2: 1}, "period": 2}, PolynomialPieces.lines({0.0: 1.0, 1.0: 2.0}, period=2.0)),
    ({"steps": {0: 1, 1: 2}, "period": 3}, PolynomialPieces.steps({0.0: 1.0, 1.0: 2.0}, period=3.0)),
]


@pytest.mark.parametrize(("given", "wanted"), WRITTEN)
def test_steps_and_lines_are_written_as_mappings(given, wanted: PolynomialPieces) -> None:
    of_file = set_of({"lower": [-1.0], "upper": [given]})
    for read in (of_file, Polytope.box([-1.0], [given]), Polytope.box(-1.0, given), Polytope([[1.0]], [-1.0], [given])):
        assert as_written(read) == as_written(Polytope.box([-1.0], [wanted]))


NO_ENDS = [
    *[(lower, STEPPED) for lower in (0.3, np.inf, PolynomialPieces([0.0, 1.0], [[0.0]], "end"))],
    (-1.0, CubicSpline(AT, np.ones((3, 2)))),
    *[(-1.0, wrong) for wrong in ({}, {"lines": 1.0}, {"steps": {0: 1}, "lines": {0: 1}}, {"lines": {0: 1}, "x": 1})],
    (-1.0, {1.0: 0.5, 0.0: 0.2}),
]


@pytest.mark.parametrize(("lower", "upper"), NO_ENDS)
def test_what_bounds_nothing_is_refused(lower, upper) -> None:
    with pytest.raises(ValueError, match=r"set|expected|rising"):
        Polytope.box([lower], [upper])


@pytest.mark.parametrize("disturbed", [False, True])
def test_controllers_keep_the_bounds_of_each_step(disturbed: bool) -> None:
    plant = plant_with(PolynomialPieces.steps({0.0: 0.3, 0.5: 0.12}), PolynomialPieces.lines({0.0: 0.2, 1.0: 0.6}))
    found = pushed(plant, 2.0, 0.002) if disturbed else learned(plant, (0.0, 2.0), 2.0)
    control = TubeController(found.tightening, 8) if disturbed else Controller(plant, 8)
    kept = found.tightening.plant if disturbed else plant
    for k, start in ((0, -0.4), (3, 0.0), (8, 0.29)):
        plan = control.step(k, np.array([start]), found)
        assert isinstance(plan, Plan)
        for i in range(1, 9):
            assert kept.state_set.at((k + i) * T).margin(plan.states[i]) >= -1e-6
            assert kept.input_set.at((k + i - 1) * T).margin(plan.inputs[i - 1]) >= -1e-6
        assert plant.input_set.at(k * T).margin(plan.input) >= 0
