"""Attack: formulas that nobody would write, references whose bounds are kept or broken by a hair."""

import random
from collections import Counter
from dataclasses import dataclass

import numpy as np
from mpmath import mp

from tests.trackably.certificates.nonlinear.instances import bounded
from tests.trackably.systems.formulas.random_expressions import many_digits
from tests.trackably.systems.nonlinear_instances import T_S, signals_exactly
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove_on_window
from trackably.checker.formulas import FUNCTIONS, SYMBOLS, Formula, Function, Name, Number, Operation, Power
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

X, U = Name("x"), Name("u")
EXPONENTS = (-2.0, -1.0, 0.5, 1.5, 2.0, 3.0, -0.7, 5.0)
SEEDS = 16


def grown(draw: random.Random, depth: int) -> Formula:
    kind = draw.random()
    if depth == 0 or kind < 0.2:
        return X if draw.random() < 0.7 else Number(round(draw.uniform(0.2, 2.0), 2))
    if kind < 0.55:
        return Operation(draw.choice(SYMBOLS), grown(draw, depth - 1), grown(draw, depth - 1))
    if kind < 0.75:
        return Power(grown(draw, depth - 1), draw.choice(EXPONENTS))
    return Function(draw.choice(FUNCTIONS), grown(draw, depth - 1))


@dataclass(frozen=True)
class Case:
    """x⁺ = x + T_s (drift + gain u)."""

    reference: Reference
    drift: Formula
    gain: Formula

    def exactly(self, name: str, t: float):
        (now,), (later,) = (signals_exactly(self.reference, mp.mpf(t) + after) for after in (0, mp.mpf(T_S)))
        if name == "x":
            return now
        drift, gain = (many_digits(part, {"x": now}) for part in (self.drift, self.gain))
        return ((later - now) / mp.mpf(T_S) - drift) / gain


def case(seed: int) -> Case | None:
    """None where the input is not defined all the way, or out of all proportion."""
    draw, rng = random.Random(seed), np.random.default_rng(seed)
    drift, gain = grown(draw, 3), grown(draw, 2)
    law = Operation("+", X, Operation("*", Number(T_S), Operation("+", drift, Operation("*", gain, U))))
    length = draw.uniform(0.2, 1.0)
    kernels = SquaredExponential(1, length), Matern52(1, length), RationalQuadratic(1, length, 1.5)
    centres = np.sort(rng.uniform(0, 1, draw.randint(1, 4)))
    signal = KernelSum(draw.choice(kernels), draw.choice([1.0, 0.6]), centres, rng.uniform(-0.3, 0.3, centres.size))
    wide, times = Polytope.box([-1e6], [1e6]), np.linspace(0, 1, 4001)
    loose = Reference((signal,), ConstrainedSystem(NonlinearSystem((law,), ("x",), ("u",), T_S), wide, wide))
    values, at_rest = loose.input_at(times), loose.quantity("u").at_rest([signal.mean])
    if not (np.all(np.isfinite([*values[:, 0], at_rest])) and 1e-6 < np.ptp(values) < 1e5):
        return None
    room = float(rng.choice([-1, 1]) * 10 ** rng.uniform(-8, -2))
    return Case(bounded(loose, times, room), drift, gain)


def test_nothing_false_is_ever_claimed():
    said: Counter[type] = Counter()
    for seed in range(SEEDS):
        if (chosen := case(seed)) is None:
            continue
        found = prove_on_window(chosen.reference, 0.0, 1.0)
        said[type(found)] += 1
        with mp.workdps(40):
            if isinstance(found, Certificate):
                for q in chosen.reference.quantities:
                    assert_kept(chosen, q, found.evaluation_error[q.name], seed)
            elif isinstance(found, Counterexample):
                value = chosen.exactly(found.quantity, found.time)
                assert max(found.bounds.lower - value, value - found.bounds.upper) >= found.violation > 0, seed
    assert min(said[Certificate], said[Counterexample]) >= 2


def assert_kept(chosen: Case, q, error: float, seed: int) -> None:
    """Where float64 sees the smallest margin many digits see more than the error, and float64 is no further off."""
    times = np.linspace(0, 1, 20_001)
    for t in times[np.argsort(q.margin(chosen.reference.signals, times))[:2]]:
        value = chosen.exactly(q.name, t)
        assert min(value - mp.mpf(q.bounds.lower), mp.mpf(q.bounds.upper) - value) >= error, seed
        assert abs(mp.mpf(float(q(chosen.reference.signals, t))) - value) <= error, seed
