"""A reference: signals (flat outputs), learned or given, and the states and inputs that they determine."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import NamedTuple

import numpy as np

from trackably.arrays import Array
from trackably.checker.subject import Side
from trackably.gp.joint import common_period
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.pieces import DoubleDouble, PolynomialPieces, Signal, moved_back, two_product
from trackably.systems.trajectories import Functional, Quantity, Trajectory

# Weighted sums of polynomial pieces in twice the precision of float64: differences of large numbers lose no digits.


def precise_values(
    coordinates: Sequence[Trajectory], signals: Sequence[PolynomialPieces], time: Sequence[Array]
) -> Array:
    """Return states or inputs, the `coordinates`, at times that are exact sums of a few float64 [s].

    The result has shape (*time.shape, coordinates). Functionals (weighted sums of signals) are evaluated in twice the
    precision, and rounded to float64 once, at the end; formulas of functionals are evaluated in float64. So a
    functional q = offset + Σ_j w_j z_j of N shifted signal values z_j is within u |q| + 100 (n + N + 2) u² G of its
    exact value. Here u = 2⁻⁵³, n is the degree of the signals, and G = |offset| + Σ_j |w_j| V, where V is the largest
    sum Σ_k |c_ik| (t_(i+1) − t_i)^k of a piece i. Certificates rely on this bound (`checker.piecewise`).
    """
    step = np.asarray(coordinates[0].sampling_time)

    @cache
    def shifted(c: int, j: int) -> DoubleDouble:
        return signals[c].precise([*time, *two_product(np.asarray(float(j)), step)])

    def value(q: Functional) -> Array:
        total = DoubleDouble.of(q.offset)
        for c, weights in enumerate(q.weights):
            for j, w in enumerate(weights):
                total = total + DoubleDouble.of(w) * shifted(c, j) if w else total
        return np.broadcast_to(total.high, np.shape(time[0]))

    return np.stack([q.value({name: value(part) for name, part in q.arguments}) for q in coordinates], axis=-1)


class Window(NamedTuple):
    """`states` x_r(k), …, x_r(k + N), shape (N + 1, n), and `inputs` u_r(k), …, u_r(k + N − 1), shape (N, m)."""

    states: Array
    inputs: Array


@dataclass(frozen=True, eq=False)
class Reference:
    """`signals`, the flat outputs of a `plant`, which determine states x_r and inputs u_r.

    By construction x_r(k + 1) = f(x_r(k), u_r(k)) for every k, and likewise from any time t to t + T_s. States and
    inputs are evaluated by sums of products, never by fast transforms, because a certificate bounds the rounding errors
    of these sums. Sums of polynomial pieces are evaluated in twice the precision, and at the exact k T_s. If all
    kernels have one period, times are first moved by whole periods to around t = 0, so that errors do not grow from
    period to period. ValueError: not as many signals as flat outputs, or some are sums of kernels and others polynomial
    pieces.
    """

    signals: tuple[Signal, ...]
    plant: ConstrainedSystem

    def __post_init__(self) -> None:
        if len(self.signals) != self.plant.signal_count:
            raise ValueError(
                f"reference: expected {self.plant.signal_count} signals, one for each flat output, got "
                f"{len(self.signals)}"
            )
        if 0 < len(self.pieces) < len(self.signals):
            raise ValueError(
                f"reference: expected signals that are all sums of kernels or all polynomial pieces, got "
                f"{len(self.pieces)} pieces among {len(self.signals)} signals"
            )

    @property
    def kernel_sums(self) -> tuple[KernelSum, ...]:
        """The signals of a learned reference. ValueError: they are polynomial pieces."""
        if self.pieces:
            raise ValueError(
                "reference: expected a learned one, with sums of kernels as signals, got one of polynomial pieces"
            )
        return tuple(signal for signal in self.signals if isinstance(signal, KernelSum))

    @property
    def pieces(self) -> tuple[PolynomialPieces, ...]:
        """The signals if they are polynomial pieces; empty if they are sums of kernels."""
        return tuple(signal for signal in self.signals if isinstance(signal, PolynomialPieces))

    @cached_property
    def period(self) -> float | None:
        """The common period [s] of all kernels, exactly this float64; None if kernels have no common period."""
        return common_period([signal.kernel for signal in self.signals if isinstance(signal, KernelSum)])

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """All bounded quantities of the plant."""
        return self.plant.quantities

    def quantity(self, name: str) -> Quantity:
        """Return the bounded quantity of this name. ValueError: no quantity has this name; the message lists all."""
        found = {quantity.name: quantity for quantity in self.quantities}
        if name not in found:
            raise ValueError(f"reference: there is no bounded quantity {name!r}; there are {', '.join(found)}")
        return found[name]

    def state(self, k: Array | int) -> Array:
        """Return x_r(k) at steps k (any shape, fractions allowed), with shape (*k.shape, n)."""
        return self._values("state", self._exact_instants(k))

    def input(self, k: Array | int) -> Array:
        """Return u_r(k), which leads from x_r(k) to x_r(k + 1); the result has shape (*k.shape, m)."""
        return self._smallest(self._values("input", self._exact_instants(k)))

    def window(self, k: int, horizon: int) -> Window:
        """Return states k … k + `horizon` and the inputs between them, for a predictive controller at step k.

        States that are equal up to whole turns (`angles` of a flat form) do not jump: whole turns are added to them.
        """
        steps = k + np.arange(horizon + 1.0)
        return Window(self.plant.unwrap(self.state(steps)), self.input(steps[:-1]))

    def state_at(self, t: Array) -> Array:
        """Return x_r at t [s]; the result has shape (*t.shape, n)."""
        return self._values("state", [np.asarray(t, dtype=float)])

    def input_at(self, t: Array) -> Array:
        """Return u_r at t [s], which leads from x_r(t) to x_r(t + T_s); shape (*t.shape, m).

        Of redundant inputs it is the smallest in U.
        """
        return self._smallest(self._values("input", [np.asarray(t, dtype=float)]))

    def instants(self, steps: Array | int) -> Array:
        """Return the times k T_s [s] of steps k."""
        return np.asarray(steps) * self.plant.sampling_time

    def _exact_instants(self, steps: Array | int) -> Sequence[Array]:
        """Return the times k T_s [s] of steps k as exact sums of two float64.

        Rounded times would matter at jumps of polynomial pieces, and after many periods.
        """
        return two_product(np.asarray(steps, dtype=float), np.asarray(self.plant.sampling_time))

    def _values(self, side: Side, time: Sequence[Array]) -> Array:
        """Return all states or inputs at times given as sums of float64; the first term is the nearest float64."""
        if self.pieces:
            return precise_values(self.plant.coordinates[side], self.pieces, time)
        t = moved_back(time, self.period) if self.period else time[0]
        signals = [signal.summed for signal in self.kernel_sums]
        return np.stack([q(signals, t) for q in self.plant.coordinates[side]], axis=-1)

    def _smallest(self, u: Array) -> Array:
        """Return the smallest inputs in U with the effect of u if inputs are redundant; otherwise u itself."""
        return self.plant.allocation.smallest(u) if self.plant.allocation else u
