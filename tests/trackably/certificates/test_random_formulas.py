"""Attack: formulas that nobody would write, references whose bounds are kept or broken by a hair."""

import random
from collections import Counter
from dataclasses import dataclass

import numpy as np
from mpmath import mp

from tests.trackably.certificates.nonlinear.instances import assert_true, bounded
from tests.trackably.systems.formulas.random_expressions import many_digits
from tests.trackably.systems.nonlinear_instances import T_S, signals_exactly
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import prove
from trackably.checker.certificate import Window
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

    def exactly(self, t: float) -> dict:
        (now,), (later,) = (signals_exactly(self.reference, mp.mpf(t) + after) for after in (0, mp.mpf(T_S)))
        drift, gain = (many_digits(part, {"x": now}) for part in (self.drift, self.gain))
        return {"x": now, "u": ((later - now) / mp.mpf(T_S) - drift) / gain}


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
    for chosen in filter(None, map(case, range(16))):
        found = prove(chosen.reference, Window(0.0, 1.0))
        said[type(found)] += 1
        if isinstance(found, Certificate | Counterexample):
            assert_true(found, chosen.exactly, 1.0)
    assert min(said[Certificate], said[Counterexample]) >= 2
