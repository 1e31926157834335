"""A reference governor on the likeliest mean: the command moves as far as a loop that is held there for ever allows.

v(k + 1) = v(k) + κ (r(k + 1) − v(k)) with the largest κ in [0, 1] such that the loop u = u_v + K (x − x_v), with v held
from then on, keeps all bounds at the next steps (E. Garone, S. Di Cairano and I. Kolmanovsky, Reference and command
governors for systems with constraints, Automatica 75, 2017). K is a linear-quadratic regulator.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from benchmarks.rivals.curves import stepping
from benchmarks.rivals.model import Found, NotFound, Problem
from trackably.arrays import Array
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import unit_scales
from trackably.systems.reference import Reference

_AHEAD = 300  # steps
_INSIDE = 1e-9  # of each width: for rounding, which may take half of it
_UNSEEN = 1e-6
_EFFORTS = (1e-6, 1e-3, 1e-2, 1e-1)  # weights of the input
_LEADS = (0, 16, 32)  # steps by which commands come earlier: of all, those are taken that bring the plant closest


@dataclass(frozen=True, eq=False)
class _Loop:
    """The loop with the command held: z = (x, v) moves as z⁺ = `moves` z, with the input `acts` z.

    Its bounds at the next steps are `rows` z ≤ `limits`, up to `rounding`; a command v at `rest` has the state
    `rest` v.
    """

    moves: Array
    acts: Array
    rest: Array
    rows: Array
    limits: Array
    rounding: Array

    @classmethod
    def of(cls, plant: ConstrainedSystem, effort: float, shown: int) -> "_Loop":
        system = plant.linear
        n = len(system.A)
        # Costs in units of the sets.
        Q = np.diag(np.where(np.arange(n) < shown, 1.0, _UNSEEN) / unit_scales(plant.state_set) ** 2)
        R = np.diag(effort / unit_scales(plant.input_set) ** 2)
        P = scipy.linalg.solve_discrete_are(system.A, system.B, Q, R)
        gain = -np.linalg.solve(R + system.B.T @ P @ system.B, system.B.T @ P @ system.A)
        rest, input_rest = (
            np.array([q.rates_at_rest([0.0] * plant.signal_count) for q in of])
            for of in (plant.flatness.states, plant.flatness.inputs)
        )
        acts = np.hstack([gain, input_rest - gain @ rest])
        moves = np.eye(n + plant.signal_count)
        moves[:n] = np.hstack([system.A, np.zeros_like(rest)]) + system.B @ acts
        (H, h), (G, g) = plant.state_set.inequalities, plant.input_set.inequalities
        now, after = np.vstack([np.pad(H, ((0, 0), (0, plant.signal_count))), G @ acts]), []
        for _ in range(_AHEAD):
            after.append(now)
            now = now @ moves
        widths = [np.tile(bounded.upper - bounded.lower, 2) for bounded in (plant.state_set, plant.input_set)]
        inside = _INSIDE * np.concatenate(widths)
        limits, rounding = np.tile([np.concatenate([h, g]) - inside, inside / 2], _AHEAD)
        return cls(moves, acts, rest, np.vstack(after), limits, rounding)

    def shares(self, z: Array, more: Array) -> tuple[Array, Array]:
        """Return the least and the largest κ in [0, 1] with z + κ more admissible, one for each row.

        Where there is none, the largest is less than the least.
        """
        room, growth = self.limits - z @ self.rows.T, more @ self.rows.T
        never = np.where(room < -self.rounding, -np.inf, np.inf)
        ends = np.divide(room, growth, out=never, where=growth != 0)
        least = np.max(np.where(growth < 0, ends, 0.0), axis=1, initial=0.0)
        return least, np.min(np.where(growth < 0, np.inf, ends), axis=1, initial=1.0)


def solve(problem: Problem) -> Found:
    """Drive the plant through the window, beginning at the equilibrium of the first command that is admissible."""
    plant = problem.task.plant
    if not isinstance(plant.system, LinearSystem) or np.any(plant.system.c):
        raise NotFound("does not apply", "is for linear systems here")
    shown = plant.signal_count
    if problem.sampled.names != plant.system.states[:shown]:
        raise NotFound("does not apply", "samples show other quantities than the first states")
    reference = Reference(problem.likeliest.posterior.signals, plant)
    steps = np.arange(round(problem.window[1] / plant.sampling_time) + 1)
    wanted = np.stack([signal(steps * plant.sampling_time) for signal in reference.signals], axis=1)
    loops = [_Loop.of(plant, effort, shown) for effort in _EFFORTS]
    ahead = [np.vstack([wanted[lead:], np.tile(wanted[-1:], (lead, 1))]) for lead in _LEADS]
    tries = [found for loop in loops for found in _followed(problem, loop, np.stack(ahead))]
    if not tries:
        raise NotFound("infeasible", "no equilibrium between rest and the first command is admissible")
    return min(tries, key=lambda found: _misfit(problem, found))


def _followed(problem: Problem, loop: _Loop, wanted: Array) -> list[Found]:
    """Follow several sequences of commands at once: shape (sequences, K + 1, m)."""
    at_rest = np.vstack([loop.rest, np.eye(wanted.shape[2])])
    rest = np.array([part.mean for part in problem.task.prior.parts])
    # Begin at the equilibrium that is nearest to the first command, on the way there from rest.
    least, most = loop.shares(np.tile(at_rest @ rest, (len(wanted), 1)), (wanted[:, 0] - rest) @ at_rest.T)
    wanted, most = wanted[least <= most], most[least <= most]
    z = (rest + most[:, None] * (wanted[:, 0] - rest)) @ at_rest.T
    n = len(loop.rest)
    states, inputs, held = [z[:, :n]], [], np.zeros(len(wanted), dtype=int)
    for command in wanted.swapaxes(0, 1)[1:]:
        more = np.hstack([np.zeros((len(z), n)), command - z[:, n:]])
        share = np.maximum(loop.shares(z, more)[1], 0.0)
        held += share < 1
        z = z + share[:, None] * more
        inputs.append(z @ loop.acts.T)
        z = z @ loop.moves.T
        states.append(z[:, :n])
    return [
        Found(
            stepping(of, moved, problem),
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
