"""Random problems whose prior mean is an admissible equilibrium: each must lead to a proved reference."""

from dataclasses import dataclass, replace

import numpy as np

from tests.trackably.certificates.instances import without_redundancy
from tests.trackably.learning.joint.instances import courses
from tests.trackably.systems.instances import controllable, unbounded
from trackably.certificates.certified import Certified, learn_certified
from trackably.certificates.outcome import Counterexample, Unproved
from trackably.gp.joint import JointPosterior, JointPrior
from trackably.gp.kernels.base import Kernel, Sum
from trackably.gp.kernels.matern import Matern32, Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.piecewise_polynomial import PiecewisePolynomial3
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior
from trackably.gp.samples import Samples
from trackably.gp.stencil import POINT, Stencil
from trackably.learning.learner import JOINT
from trackably.learning.problem import NoSolution
from trackably.learning.space import SearchSpace
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope

_SPAN = 2.0
_KERNELS: tuple[Kernel, ...] = (
    SquaredExponential(lengthscale=(0.2, 2.0)),
    Matern52(lengthscale=(0.3, 3.0)),
    RationalQuadratic(lengthscale=(0.3, 3.0), shape=1.5),
    Periodic(lengthscale=(0.3, 3.0), period=(1.7, 2.5)),
    Matern32(lengthscale=(0.3, 3.0)),
    PiecewisePolynomial3(lengthscale=(1.0, 8.0)),
    Sum(SquaredExponential(lengthscale=(0.2, 1.0)), Matern52(0.4, 1.5)),
)


@dataclass(frozen=True)
class Problem:
    """What `learn_certified` takes."""

    samples: tuple[Samples, ...]
    prior: JointPrior
    plant: ConstrainedSystem

    @property
    def space(self) -> SearchSpace:
        return SearchSpace.around(self.samples, self.prior, starts=2)

    def learned(self) -> Certified | NoSolution | Counterexample | Unproved:
        return learn_certified(self.samples, self.prior, self.plant, self.space, learner=JOINT)


def random_problem(seed: int) -> Problem:
    """One to four states, one or two inputs; the bounds leave 25 to 100 % of what a plain fit does, on either side."""
    rng = np.random.default_rng(seed)
    loose = unbounded(_system(rng, seed))
    count = loose.signal_count
    chosen = int(rng.integers(len(_KERNELS)))
    kernel = _KERNELS[chosen]
    noise_std, level = 10 ** rng.uniform(-2, -0.7), float(rng.choice([0.0, rng.normal()]))
    prior = JointPrior(
        tuple(Prior(kernel, noise_std, level) for _ in range(count)),
        ("x", "y")[:count] if count > 1 else ("",),
        frozenset({"period"} if isinstance(kernel, Periodic) and count > 1 else ()),
    )
    samples = _samples(rng, loose, noise_std, level)
    return Problem(samples, prior, _bounded(rng, loose, JointPosterior(prior, samples)))


def _system(rng: np.random.Generator, seed: int) -> LinearSystem:
    """Matrices without structure, or chains of integrators with friction, one or two, coupled or not."""
    if seed % 3 == 0:
        return without_redundancy(controllable(seed))
    lengths = [int(rng.integers(1, 5))] if seed % 3 == 1 else rng.integers(1, 3, size=2).tolist()
    n, ends = sum(lengths), np.cumsum(lengths) - 1
    A = np.eye(n, k=1)
    A[ends] = 0.0
    A[ends, ends] = -rng.uniform(0, 2, len(ends)) * rng.integers(0, 2, len(ends))
    B = np.eye(n)[:, ends] * rng.uniform(0.3, 3, len(ends))
    if rng.random() < 0.5:
        B[ends] += 0.2 * rng.normal(size=(len(ends), len(ends)))
    return LinearSystem.discretised(A, B, 10 ** rng.uniform(-2, -0.7))


def _samples(rng: np.random.Generator, loose: ConstrainedSystem, noise_std: float, level: float) -> tuple[Samples, ...]:
    """Of flat outputs, or of a state that shows one of them; at times of their own."""
    found = []
    for c, course in enumerate(courses(loose.signal_count, _SPAN)):
        times = np.sort(rng.choice(np.arange(1, 41), int(rng.integers(8, 15)), replace=False)) * _SPAN / 40
        shown = [stencil for signal, stencil in _stencils(loose) if signal == c]
        stencil = shown[int(rng.integers(len(shown)))] if shown and rng.random() < 0.5 else POINT
        clean = stencil.measured(lambda t, course=course: level + course(t), times)
        scale = np.ptp(clean)
        values = clean + noise_std * scale * rng.standard_normal(times.size)
        found.append(Samples(times, values, np.full(times.size, scale), stencil))
    return tuple(found)


def _stencils(loose: ConstrainedSystem) -> list[tuple[int, Stencil]]:
    return [q.stencil for q in loose.flatness.states if q.stencil]


def _bounded(rng: np.random.Generator, loose: ConstrainedSystem, plain: JointPosterior) -> ConstrainedSystem:
    levels, t = [part.mean for part in plain.prior.parts], np.linspace(0, 1.5 * _SPAN, 301)
    sets = []
    for coordinates in (loose.flatness.states, loose.flatness.inputs):
        d = len(coordinates)
        rows = (
            np.eye(d) if rng.random() < 0.6 else np.vstack([np.eye(d), rng.normal(size=(int(rng.integers(1, 3)), d))])
        )
        values = rows @ np.stack([q(plain.signals, t) for q in coordinates])
        rest = rows @ np.array([q.at_rest(levels) for q in coordinates])
        reach = np.max(np.abs(values - rest[:, None]), axis=1)
        below, above = 10 ** rng.uniform(-0.6, 0, (2, len(rows)))
        sets.append(Polytope(rows, rest - below * reach, rest + above * reach))
    return replace(loose, state_set=sets[0], input_set=sets[1])
