"""A step of the tube controller beside one of the nominal controller, from the same states."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.duel import Row
from pipeline.disturbed import Case, experiments, random_systems
from trackably.arrays import Array
from trackably.control.controller import Controller, scaled_controller
from trackably.control.references import TabulatedReference, TrackedReference
from trackably.control.stepping import Plan, Status
from trackably.control.tube import TubeController

HORIZON, _FIRST = 20, 30
RANDOM, _STATES = 8, 12
_CALLS, _ROUNDS = 10, 3
TARGET = 3.0
DISTANCES = {"in the tube": (0.3, 0.9), "near the tube": (1.05, 1.6), "far off": (2.0, 20.0)}
"""How far states lie from the reference, in parts of the way to the edge of the tube."""

ENDS = {
    "no bound is active": (Status.NO_ACTIVE_BOUND, Status.NO_ACTIVE_BOUND),
    "bounds are active": (Status.SOLVED, Status.SOLVED),
    "only tightened bounds are active": (Status.SOLVED, Status.NO_ACTIVE_BOUND),
}
"""How both steps end: in a formula, in a program, or in a program of the tube controller only."""


@dataclass(frozen=True)
class Step:
    """Seconds of the tube controller and of the nominal one from a state, and how both ended."""

    distance: str
    tube: float
    nominal: float
    ended: tuple[Status, Status] | None


def rows() -> Iterator[Row]:
    """Medians over states, for each experiment with disturbances and for random systems together."""
    cases = {case.name: [case] for case in experiments(Path("data/results"))}
    cases["random systems"] = list(random_systems(RANDOM))
    for name, some in cases.items():
        steps = [step for case in some for step in _steps(case)]
        for distance, (how, ended) in product(DISTANCES, ENDS.items()):
            alike = [step for step in steps if step.distance == distance and step.ended == ended]
            if alike:
                target = TARGET if ended[0] == ended[1] else None
                yield _row(f"{name}, {distance}, {how}, {len(alike)} states", alike, target)


def _row(problem: str, steps: list[Step], target: float | None) -> Row:
    ratios = np.array([step.tube / step.nominal for step in steps])
    tube, nominal = np.median([[step.tube, step.nominal] for step in steps], axis=0).tolist()
    lowest, middle, latest = np.quantile(ratios, [0.0, 0.5, 0.95]).tolist()
    return Row(
        "one step of the tube controller",
        problem,
        "nominal controller",
        tube,
        nominal,
        middle,
        lowest,
        latest,
        target,
        at_most=True,
        note="with a table of the reference; the range ends at the 95th percentile",
    )


def _steps(case: Case) -> Iterator[Step]:
    nominal = scaled_controller(case.tightening.given, HORIZON)
    tube = TubeController(case.tightening, HORIZON, nominal.Q, nominal.R)
    reference = TabulatedReference.of(case.robust, _FIRST, _FIRST + HORIZON)
    rng = np.random.default_rng(0)
    for distance, (least, most) in DISTANCES.items():
        for _ in range(_STATES):
            direction = rng.standard_normal(len(nominal.Q)) / np.sqrt(np.diag(nominal.Q))
            off = rng.uniform(least, most) * edge(tube, direction)
            state = reference.window(_FIRST, 1).states[0] + off
            yield _step(distance, (tube, nominal), state, reference)


def edge(tube: TubeController, direction: Array) -> Array:
    """Return the error at the edge of Z in a direction."""
    inside, outside = 0.0, 1.0
    while tube.errors.contains(outside * direction):
        outside *= 2
    while outside - inside > 1e-3 * outside:
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if tube.errors.contains(middle * direction) else (inside, middle)
    return inside * direction


def _step(
    distance: str, controllers: tuple[TubeController, Controller], state: Array, reference: TrackedReference
) -> Step:
    """Both in turns, the fastest of some rounds."""
    times = np.array([[seconds(of, _FIRST, state, reference) for of in controllers] for _ in range(_ROUNDS)])
    tube, nominal = np.min(times, axis=0).tolist()
    plans = [of.step(_FIRST, state, reference) for of in controllers]
    ended = tuple(plan.status for plan in plans if isinstance(plan, Plan))
    return Step(distance, tube, nominal, (ended[0], ended[1]) if len(ended) == 2 else None)


def seconds(controller: Controller | TubeController, k: int, state: Array, reference: TrackedReference) -> float:
    """Return the processor time of one step [s], the mean of some."""
    controller.step(k, state, reference)
    before = process_time()
    for _ in range(_CALLS):
        controller.step(k, state, reference)
    return (process_time() - before) / _CALLS
