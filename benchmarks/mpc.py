"""One step of the tracking controller, from parameter update to input: `python benchmarks/mpc.py [horizon]`.

Beside it the same step with everything built afresh, as it would be without parameters. Medians, in milliseconds of
processor time on one thread, which is what a clock shows on a machine with nothing else to do.
"""

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from statistics import median
from time import process_time

import numpy as np
from threadpoolctl import threadpool_limits

from pipeline.arrays import Array
from pipeline.control.answer import Status, Step
from pipeline.control.controller import Controller
from pipeline.control.followed import Followed
from pipeline.gp.radial import SquaredExponential
from pipeline.gp.signal import KernelSum
from pipeline.systems.constrained import ConstrainedSystem
from pipeline.systems.linear import Linear
from pipeline.systems.polytope import Polytope
from pipeline.systems.reference import Reference

_REPEATS, _DRAWS = 40, 400


def masses(count: int) -> ConstrainedSystem:
    """`count` carts on a rail, each with an acceleration of its own: two states and one input for each."""
    A, B = (np.asarray(np.kron(np.eye(count), block), dtype=float) for block in ([[0, 1], [0, 0]], [[0], [1]]))
    states = np.tile([1.2, 2.0], count)
    inputs = np.full(count, 4.0)
    system = Linear.discretised(A, B, 0.05)
    return ConstrainedSystem(system, Polytope.box(-states, states), Polytope.box(-inputs, inputs), 0.05)


def sine(plant: ConstrainedSystem) -> Reference:
    """Twenty-five centres for each signal, as after learning from as many samples."""
    centres = np.linspace(0, 6, 25)
    kernel = SquaredExponential(1.0, 0.6)
    weights = np.linalg.solve(kernel(centres[:, None] - centres) + 1e-3 * np.eye(25), 0.8 * np.sin(1.5 * centres))
    return Reference((KernelSum(kernel, 0.0, centres, np.asarray(weights, dtype=float)),) * plant.signals, plant)


def sorted_by_answer(controller: Controller, reference: Followed, starts: Iterable[Array]) -> dict[str, list[Array]]:
    """The starts by how they are answered: a status, or infeasible."""
    found: dict[str, list[Array]] = {}
    for start in starts:
        answer = controller.step(0, start, reference)
        found.setdefault(answer.status if isinstance(answer, Step) else "infeasible", []).append(start)
    return found


def milliseconds(question: Callable[[Array], object], starts: Sequence[Array]) -> float:
    """The median over the starts; NaN without any."""
    taken = []
    for start in starts[:_REPEATS]:
        before = process_time()
        question(start)
        taken.append(1e3 * (process_time() - before))
    return median(taken) if taken else float("nan")


def main(horizon: int) -> None:
    """Print the table."""
    print(f"horizon {horizon}, milliseconds a step")
    print("states  unbounded  solved  built afresh  ratio  infeasible")
    for count in (1, 2):
        plant = masses(count)
        reference, n = sine(plant), 2 * count
        controller = Controller(plant, horizon, np.eye(n), 0.1 * np.eye(count))
        rng = np.random.default_rng(0)
        starts = [reference.state(0) + rng.uniform(0.01, 1.5) * rng.standard_normal(n) for _ in range(_DRAWS)]
        found = sorted_by_answer(controller, reference, starts)

        def step(start: Array, controller: Controller = controller, reference: Reference = reference) -> object:
            return controller.step(0, start, reference)

        def afresh(start: Array, controller: Controller = controller, reference: Reference = reference) -> object:
            # Without cached properties, the controller has to build its programs again.
            return replace(controller).step(0, start, reference)

        free, solved, refused = (
            milliseconds(step, found[way]) for way in (Status.UNBOUNDED, Status.SOLVED, "infeasible")
        )
        anew = milliseconds(afresh, found[Status.SOLVED][:10])
        print(f"{n:6} {free:10.3f} {solved:7.2f} {anew:13.1f} {anew / solved:6.1f} {refused:11.2f}")


if __name__ == "__main__":
    with threadpool_limits(limits=1):
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
