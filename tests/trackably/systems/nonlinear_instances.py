"""Nonlinear systems as a user would write them, with sets, and references that move through them."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpmath import mp

from tests.trackably.gp.instances import formula
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.nonlinear import NonlinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

T_S = 0.1


@dataclass(frozen=True)
class Instance:
    """f(x, u, m) with the functions of a module m; a box of states, one of inputs, and where it is at rest."""

    f: Any
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    state_box: tuple[list[float], list[float]]
    input_box: tuple[list[float], list[float]]
    rest: list[float]

    @property
    def system(self) -> NonlinearSystem:
        return NonlinearSystem.of(lambda x, u: self.f(x, u, np), self.states, self.inputs, T_S)

    @property
    def plant(self) -> ConstrainedSystem:
        boxes = [Polytope.box(np.array(low), np.array(high)) for low, high in (self.state_box, self.input_box)]
        return ConstrainedSystem(self.system, boxes[0], boxes[1])

    def inputs_exactly(self, x: list, later: list) -> list:
        """u with f(x, u) = later in many digits, from f at u = 0 and at unit vectors."""
        n = len(x)
        at_zero = self.f(x, [mp.mpf(0)] * n, mp)
        at_unit = [self.f(x, [mp.mpf(i == j) for i in range(n)], mp) for j in range(n)]
        gain = mp.matrix([[at_unit[j][i] - at_zero[i] for j in range(n)] for i in range(n)])
        return list(mp.lu_solve(gain, mp.matrix([later[i] - at_zero[i] for i in range(n)])))


def tank(x, u, m):
    """Torricelli's law."""
    (level,) = x
    (inflow,) = u
    return [level + T_S / 2.0 * (inflow - 0.6 * m.sqrt(level))]


def harvest(x, u, m):
    """Verhulst's growth, harvested by effort."""
    (stock,) = x
    (effort,) = u
    return [stock + T_S * (stock * (1 - stock / 1.3) - effort * stock)]


def reactor(x, u, m):
    """A stirred tank with a reaction that heats it: feed and cooling."""
    concentration, temperature = x
    feed, cooling = u
    rate = 0.5 * m.exp(-1 / temperature) * concentration
    return [
        concentration + T_S * (feed * (1.5 - concentration) - rate),
        temperature + T_S * (feed * (1 - temperature) + rate - cooling),
    ]


def pendulum(x, u, m):
    """Heavily damped: the torque sets the speed."""
    (angle,) = x
    (torque,) = u
    return [angle + T_S * (torque - m.sin(angle))]


def vehicle(x, u, m):
    """Both inputs move both states: Cramer's rule."""
    along, across = x
    forward, sideward = u
    c, s = m.cos(0.3 * along), m.sin(0.3 * across)
    return [along + T_S * (c * forward - s * sideward), across + T_S * (s * forward + c * sideward) - 0.01 * along**2]


def growth(x, u, m):
    """Powers and logarithms."""
    (size,) = x
    (food,) = u
    return [size + T_S * (food * size**0.75 - 0.2 * size * m.log(1 + size) + 0.1 / size**2)]


INSTANCES = {
    "tank": Instance(tank, ("level",), ("inflow",), ([0.2], [2.0]), ([-1.0], [2.5]), [0.8]),
    "harvest": Instance(harvest, ("stock",), ("effort",), ([0.1], [1.2]), ([-3.0], [3.0]), [0.6]),
    "pendulum": Instance(pendulum, ("angle",), ("torque",), ([-2.0], [2.0]), ([-3.0], [3.0]), [0.1]),
    "growth": Instance(growth, ("size",), ("food",), ([0.3], [2.0]), ([-3.0], [3.0]), [0.9]),
    "reactor": Instance(
        reactor, ("c", "temp"), ("feed", "cooling"), ([0.1, 0.4], [1.1, 1.6]), ([-2.0, -4.0], [4.0, 4.0]), [0.6, 0.8]
    ),
    "vehicle": Instance(
        vehicle, ("along", "across"), ("v", "w"), ([-2.0, -2.0], [2.0, 2.0]), ([-5.0, -5.0], [5.0, 5.0]), [0.2, 0.0]
    ),
}


def moving(instance: Instance, seed: int = 0, size: float = 0.3, centres: int = 3) -> Reference:
    """A reference around the rest, within about `size`."""
    rng = np.random.default_rng(seed)
    signals = tuple(
        KernelSum(
            SquaredExponential(1.0, 0.7), level, np.linspace(0.0, 1.0, centres), size * rng.uniform(-1, 1, centres)
        )
        for level in instance.rest
    )
    return Reference(signals, instance.plant)


def signals_exactly(reference: Reference, t) -> list:
    """z(t) in many digits."""
    t, found = mp.mpf(t), []
    for signal in reference.signals:
        kappa = formula(signal.kernel)
        pairs = zip(signal.weights, signal.centres, strict=True)
        found.append(mp.mpf(signal.mean) + mp.fsum(mp.mpf(c) * kappa(t - mp.mpf(t_i)) for c, t_i in pairs))
    return found


def exactly(instance: Instance, reference: Reference, t) -> dict:
    """States and inputs at t by name, in many digits."""
    now, later = (signals_exactly(reference, s) for s in (mp.mpf(t), mp.mpf(t) + mp.mpf(T_S)))
    names = [*instance.states, *instance.inputs]
    return dict(zip(names, [*now, *instance.inputs_exactly(now, later)], strict=True))


LINEAR = LinearSystem(
    np.array([[0.9, 0.1], [-0.2, 1.0]]), np.array([[0.5, 0.1], [0.0, -2.0]]), np.array([0.1, 0.0]), sampling_time=T_S
)


def as_formulas(system: LinearSystem) -> NonlinearSystem:
    """The same system, written as formulas."""
    return NonlinearSystem.of(lambda x, u: system.A @ x + system.B @ u + system.c, system.states, system.inputs, T_S)
