"""A reference governor on the likeliest mean: the command moves as far as a loop that is held there for ever allows.

v(k + 1) = v(k) + κ (r(k + 1) − v(k)) with the largest κ in [0, 1] such that the loop u = u_v + K (x − x_v), with v held
from then on, keeps all bounds at the next steps (E. Garone, S. Di Cairano and I. Kolmanovsky, Reference and command
governors for systems with constraints, Automatica 75, 2017). K is a linear-quadratic regulator.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from benchmarks.rivals.judge import StepCurve
from benchmarks.rivals.model import Answer, Found, NotFound, Problem, Promise, Rival
from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference

_AHEAD = 300  # steps at most
_SETTLED = 1e-12  # of an error: later steps bound the command alone
_INSIDE = 1e-9  # of each width: for rounding, which may take half of it
_UNSEEN = 1e-6
_EFFORTS = (1e-6, 1e-3, 1e-2, 1e-1)  # weights of the input
_LEADS = (0, 16, 32)  # steps by which commands come earlier: of all, those are taken that bring the plant closest


@dataclass(frozen=True, eq=False)
class _Loop:
    """The bounds of the next steps: `by_error` (x − x_v) + `by_command` v ≤ `limits`, up to `rounding`."""

    plant: ConstrainedSystem
    gain: Array
    at_rest: Array
    input_at_rest: Array
    by_error: Array
    by_command: Array
    limits: Array
    rounding: Array

    @classmethod
    def of(cls, plant: ConstrainedSystem, effort: float, shown: tuple[int, ...]) -> "_Loop":
        system = plant.linear
        n, m = system.B.shape
        # Unit costs in units of the sets.
        Q = np.diag([1.0 if i in shown else _UNSEEN for i in range(n)]) * _scales(plant.state_set, n)
        R = _scales(plant.input_set, m)
        P = scipy.linalg.solve_discrete_are(system.A, system.B, Q, effort * R)
        gain = -np.linalg.solve(effort * R + system.B.T @ P @ system.B, system.B.T @ P @ system.A)
        levels = np.eye(plant.signal_count)
        zero = np.zeros(plant.signal_count)
        rest = np.array([[f.at_rest(v) - f.at_rest(zero) for v in levels] for f in plant.flatness.states])
        input_rest = np.array([[f.at_rest(v) - f.at_rest(zero) for v in levels] for f in plant.flatness.inputs])
        H, h = plant.state_set.inequalities
        G, g = plant.input_set.inequalities
        widths = [bounded.upper - bounded.lower for bounded in (plant.state_set, plant.input_set)]
        inside = _INSIDE * np.concatenate([np.tile(w, 2) for w in widths])
        closed, rows, commands, power = system.A + system.B @ gain, [], [], np.eye(n)
        for _ in range(_AHEAD):
            power = power * (np.max(np.abs(power)) > _SETTLED)
            rows += [H @ power, G @ gain @ power]
            commands += [H @ rest, G @ input_rest]
            if not np.any(power):
                break
            power = closed @ power
        limits, rounding = np.tile([np.concatenate([h, g]) - inside, inside / 2], len(rows) // 2)
        return cls(plant, gain, rest, input_rest, np.vstack(rows), np.vstack(commands), limits, rounding)

    def shares(self, x: Array, v: Array, wanted: Array) -> Array:
        """Return the largest κ with v + κ (wanted − v) admissible from x, one for each row; zero if not even v is."""
        here = (x - v @ self.at_rest.T) @ self.by_error.T + v @ self.by_command.T
        more = (wanted - v) @ (self.by_command - self.by_error @ self.at_rest).T
        room = self.limits - here
        allowed = np.divide(room, more, out=np.ones_like(room), where=more > 0)
        return np.where(np.any(room < -self.rounding, axis=1), 0.0, np.clip(np.min(allowed, axis=1), 0.0, 1.0))


def _scales(bounded: Polytope, n: int) -> Array:
    """Return one over the square of the half width of each coordinate, on the diagonal; one where it has no bound."""
    widths = bounded.upper - bounded.lower
    each = [[w / abs(row[i]) / 2 for row, w in zip(bounded.rows, widths, strict=True) if row[i]] for i in range(n)]
    return np.diag([1 / min(of) ** 2 if of else 1.0 for of in each])


def solve(problem: Problem) -> Answer:
    """Drive the plant through the window, beginning at the equilibrium of the first command that is admissible."""
    plant = problem.task.plant
    if not isinstance(plant.system, LinearSystem) or np.any(plant.system.c):
        return NotFound("does not apply", "is for linear systems here")
    names = problem.sampled.names
    if any(name not in plant.system.states for name in names):
        return NotFound("does not apply", "samples show no state")
    reference = Reference(problem.likeliest.posterior.signals, plant)
    steps = np.arange(round(problem.window[1] / plant.sampling_time) + 1)
    wanted = np.stack([signal(steps * plant.sampling_time) for signal in reference.signals], axis=1)
    shown = tuple(plant.system.states.index(name) for name in names)
    loops = [_Loop.of(plant, effort, shown) for effort in _EFFORTS]
    ahead = [np.vstack([wanted[lead:], np.tile(wanted[-1:], (lead, 1))]) for lead in _LEADS]
    tries = [found for loop in loops for found in _followed(problem, loop, np.stack(ahead))]
    if not tries:
        return NotFound("infeasible", "no equilibrium between rest and the first command is admissible")
    return min(tries, key=lambda found: _misfit(problem, found))


def _followed(problem: Problem, loop: _Loop, wanted: Array) -> list[Found]:
    """Follow several sequences of commands at once: shape (sequences, K + 1, m)."""
    plant = loop.plant
    rest = np.array([part.mean for part in problem.task.prior.parts])
    begun = [(first, _admissible(loop, rest, first)) for first in wanted[:, 0]]
    kept = [i for i, (_, part) in enumerate(begun) if part is not None]
    if not kept:
        return []
    wanted = wanted[kept]
    v = np.array([rest + part * (first - rest) for first, part in begun if part is not None])
    x = v @ loop.at_rest.T
    states, inputs, held = [x], [], np.zeros(len(wanted), dtype=int)
    for r in wanted.swapaxes(0, 1)[1:]:
        share = loop.shares(x, v, r)
        held += share < 1
        v = v + share[:, None] * (r - v)
        u = v @ loop.input_at_rest.T + (x - v @ loop.at_rest.T) @ loop.gain.T
        x = x @ plant.linear.A.T + u @ plant.linear.B.T
        inputs.append(u)
        states.append(x)
    shown = tuple(plant.system.states.index(name) for name in problem.sampled.names)
    return [
        Found(
            StepCurve(plant, of, moved, shown),
            places=wanted.shape[1],
            says=f"the command was held back at {count} of {len(moved)} steps; between steps nothing is said",
        )
        for of, moved, count in zip(np.stack(states, axis=1), np.stack(inputs, axis=1), held.tolist(), strict=True)
    ]


def _misfit(problem: Problem, found: Found) -> float:
    pairs = enumerate(problem.task.samples)
    return max(
        float(np.sum((found.curve.sampled(i, s.times) - s.values) ** 2) / np.ptp(s.values) ** 2) for i, s in pairs
    )


def _admissible(loop: _Loop, rest: Array, wanted: Array) -> float | None:
    """Return how far the first equilibrium may be from rest towards what is wanted; None: none is admissible."""
    here, more = loop.limits - loop.by_command @ rest, loop.by_command @ (wanted - rest)
    if np.any(here[more == 0] < 0):
        return None
    least = max(0.0, np.max(here[more < 0] / more[more < 0], initial=0.0))
    most = min(1.0, np.min(here[more > 0] / more[more > 0], initial=1.0))
    return float(most) if least <= most else None


GOVERNOR = Rival(
    "i",
    "reference governor on the likeliest mean",
    Promise("", "Garone, Di Cairano & Kolmanovsky 2017; our own program", "bounds at all steps, for any reference"),
    solve,
)
