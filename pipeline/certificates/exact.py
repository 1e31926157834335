"""A reference's bounded quantities as exact real functions of time, defined by the stored numbers alone."""

from dataclasses import dataclass

from flint import arb

from pipeline.certificates.balls import ball_arithmetic
from pipeline.certificates.growth import beyond
from pipeline.certificates.series import value
from pipeline.gp.signal import KernelSum
from pipeline.systems.interval import Interval
from pipeline.systems.reference import Reference
from pipeline.systems.scalar import ConstrainedSystem


@dataclass(frozen=True)
class ExactQuantity:
    """q(t) = offset + Σ_j w_j Σ_i c_i κ(t + s_j − t_i), wanted in `bounds`; `terms` holds the (w_j, s_j).

    The weights are those of the formulas, not of their float64 evaluation: 1/b is a ball, no rounded quotient.
    """

    name: str
    signal: KernelSum
    terms: tuple[tuple[arb, arb], ...]
    offset: arb
    bounds: Interval

    def at(self, t: arb) -> arb:
        """Enclosure of q(t)."""
        with ball_arithmetic():
            pairs = [(arb(t_i), arb(c)) for t_i, c in centres_and_weights(self.signal)]
            kernel = self.signal.kernel
            return self.offset + sum(
                (w * sum((c * value(kernel, t + s - t_i) for t_i, c in pairs), arb(0)) for w, s in self.terms), arb(0)
            )

    def margin_at(self, t: arb) -> arb:
        """Enclosure of the distance to the nearer bound: certainly negative where a bound is certainly broken."""
        with ball_arithmetic():
            q = self.at(t)
            return (q - arb(self.bounds.lower)).min(arb(self.bounds.upper) - q)


def centres_and_weights(signal: KernelSum) -> list[tuple[float, float]]:
    """(t_i, c_i) of a signal."""
    return list(zip(signal.centres.tolist(), signal.weights.tolist(), strict=True))


def exact_quantities(reference: Reference) -> tuple[ExactQuantity, ExactQuantity]:
    """x_r(t) = m⁺(t) and u_r(t) = (m⁺(t + T_s) − a m⁺(t) − c)/b."""
    plant, signal = reference.plant, reference.signal
    with ball_arithmetic():
        a, b, c, mean = (arb(v) for v in (plant.system.a, plant.system.b, plant.system.c, signal.mean))
        step = arb(plant.sampling_time)
        return (
            ExactQuantity("state", signal, ((arb(1), arb(0)),), mean, plant.state_set),
            ExactQuantity(
                "input", signal, ((1 / b, step), (-a / b, arb(0))), (mean - a * mean - c) / b, plant.input_set
            ),
        )


def limits_beyond(reference: Reference, start: arb) -> dict[str, tuple[arb, arb]]:
    """Centre and reach of an interval that holds each quantity for all real t ≥ `start` [s]: an over-estimate.

    With e = m⁺ − m: |e(t)| ≤ m̄ = Σ |c_i| K_i and |ė(t)| ≤ Σ |c_i| D_i, where K_i and D_i bound |κ| and |κ̇| at all
    distances from start − t_i on. u_r(t) − u_m is ((1 − a) e(t) + (e(t + T_s) − e(t)))/b, or (e(t + T_s) − a e(t))/b.
    """
    signal = reference.signal
    with ball_arithmetic(2):
        reach, rate = arb(0), arb(0)
        for t_i, c in centres_and_weights(signal):
            kappa, slope = beyond(signal.kernel, (start - arb(t_i)).max(arb(0)))
            reach += abs(arb(c)) * kappa
            rate += abs(arb(c)) * slope
        return {"state": (arb(signal.mean), reach), "input": _input_limits(reference.plant, signal.mean, reach, rate)}


def _input_limits(plant: ConstrainedSystem, mean: float, reach: arb, rate: arb) -> tuple[arb, arb]:
    a, b, c, m = arb(plant.system.a), arb(plant.system.b), arb(plant.system.c), arb(mean)
    by_rate = abs(1 - a) * reach + arb(plant.sampling_time) * rate
    by_reach = (1 + abs(a)) * reach
    return (m - a * m - c) / b, by_rate.min(by_reach) / abs(b)
