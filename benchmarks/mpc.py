"""One step of the tracking controller, from parameter update to input.

Beside it the same step with everything built afresh, as it would be without parameters, and do-mpc's.
"""

import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.duel import Row, agree, duel
from trackably.arrays import Array
from trackably.control.controller import Controller
from trackably.control.references import TrackedReference
from trackably.control.stepping import Plan, Status
from trackably.control.tube import TubeController
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.signal import KernelSum
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.disturbances import Zonotope
from trackably.systems.linear import LinearSystem
from trackably.systems.polytopes import Polytope
from trackably.systems.reference import Reference
from trackably.systems.tightening import tightening

_STARTS, _DRAWS = 40, 400


def masses(count: int) -> ConstrainedSystem:
    """`count` carts on a rail, each with an acceleration of its own: two states and one input for each."""
    A, B = (np.asarray(np.kron(np.eye(count), block), dtype=float) for block in ([[0, 1], [0, 0]], [[0], [1]]))
    states = np.tile([1.2, 2.0], count)
    inputs = np.full(count, 4.0)
    system = LinearSystem.discretised(A, B, 0.05)
    return ConstrainedSystem(system, Polytope.box(-states, states), Polytope.box(-inputs, inputs))


def sine(plant: ConstrainedSystem) -> Reference:
    """Twenty-five centres for each signal, as after learning from as many samples."""
    centres = np.linspace(0, 6, 25)
    kernel = SquaredExponential(1.0, 0.6)
    weights = np.linalg.solve(kernel(centres[:, None] - centres) + 1e-3 * np.eye(25), 0.8 * np.sin(1.5 * centres))
    return Reference((KernelSum(kernel, 0.0, centres, np.asarray(weights, dtype=float)),) * plant.signal_count, plant)


def by_status(controller: Controller, reference: TrackedReference, starts: Iterable[Array]) -> dict[str, list[Array]]:
    """Sort initial states by the status of their plan, or as what they are without one."""
    found: dict[str, list[Array]] = {}
    for start in starts:
        result = controller.step(0, start, reference)
        found.setdefault(result.status if isinstance(result, Plan) else type(result).__name__.lower(), []).append(start)
    return found


def rows(horizon: int = 20) -> Iterator[Row]:
    """A step where bounds are active, at as many starts in turn; and one where none is."""
    for count in (1, 2):
        plant = masses(count)
        reference, n = sine(plant), 2 * count
        Q, R = np.eye(n), 0.1 * np.eye(count)
        controller = Controller(plant, horizon, Q, R)
        rng = np.random.default_rng(0)
        starts = [reference.state(0) + rng.uniform(0.01, 1.5) * rng.standard_normal(n) for _ in range(_DRAWS)]
        found = by_status(controller, reference, starts)
        theirs = do_mpc_step(plant, reference, horizon, Q, R)
        for start in found[Status.SOLVED][:_STARTS]:
            result = controller.step(0, start, reference)
            assert isinstance(result, Plan)
            agree("controller, first input", float(np.linalg.norm(result.input - theirs(start))), 0.0, 1e-4)

        def every(step: Callable[[Array], object], starts: list[Array]) -> Callable[[], object]:
            turn = 0

            def next_step() -> object:
                nonlocal turn
                turn += 1
                return step(starts[turn % len(starts)])

            return next_step

        def step(start: Array, controller: Controller = controller, reference: Reference = reference) -> object:
            return controller.step(0, start, reference)

        def afresh(start: Array, controller: Controller = controller, reference: Reference = reference) -> object:
            # Without cached properties, the controller has to build its programs again.
            return replace(controller).step(0, start, reference)

        for status in (Status.SOLVED, Status.NO_ACTIVE_BOUND):
            some = found[status][:_STARTS]
            active = "bounds" if status is Status.SOLVED else "no bound"
            problem = f"{n} states, horizon {horizon}, {active} active"
            for rival, function, rounds in (("built afresh", afresh, 3), ("do-mpc", theirs, 5)):
                yield duel(
                    "one step of the controller",
                    problem,
                    rival,
                    every(step, some),
                    every(function, some),
                    rounds=rounds,
                )
    yield from tube_rows(horizon)


def tube_rows(horizon: int = 20) -> Iterator[Row]:
    """A step of the tube controller beside one of the nominal controller, at starts where both solve a program."""
    for count in (1, 2):
        plant, n, push = masses(count), 2 * count, np.tile([0.0, 0.02], count)
        drawn_in = tightening(plant, Zonotope.box(-push, push))
        reference, rng = sine(drawn_in.plant), np.random.default_rng(0)
        nominal = Controller(plant, horizon, np.eye(n), 0.1 * np.eye(count))
        tube = TubeController(drawn_in, horizon, nominal.Q, nominal.R)
        starts = [reference.state(0) + rng.uniform(0.01, 1.5) * rng.standard_normal(n) for _ in range(_DRAWS // 2)]
        some = [start for start in by_status(nominal, reference, starts)[Status.SOLVED]
                if isinstance(tube.step(0, start, reference), Plan)][:_STARTS]  # fmt: skip

        def all_steps(of: Controller | TubeController, some: list[Array] = some, along: Reference = reference) -> None:
            for start in some:
                of.step(0, start, along)

        yield duel(
            "one step of the tube controller",
            f"{n} states, horizon {horizon}, {len(some)} starts off the tube",
            "nominal controller",
            partial(all_steps, tube),
            partial(all_steps, nominal),
            rounds=3,
            target=3.0,
            at_most=True,
        )


def do_mpc_step(
    plant: ConstrainedSystem, reference: Reference, horizon: int, Q: Array, R: Array
) -> Callable[[Array], Array]:
    """The same problem in do-mpc, built once: the first input of the plan from a state at step 0."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of features that are not installed
        from do_mpc.controller import MPC
        from do_mpc.model import Model

    system = plant.system
    assert isinstance(system, LinearSystem)
    n, m = system.B.shape
    model = Model("discrete")
    x, u = model.set_variable("_x", "x", (n, 1)), model.set_variable("_u", "u", (m, 1))
    along, input_along = model.set_variable("_tvp", "x_r", (n, 1)), model.set_variable("_tvp", "u_r", (m, 1))
    model.set_rhs("x", system.A @ x + system.B @ u)
    model.setup()
    mpc = MPC(model)
    mpc.set_param(n_horizon=horizon, t_step=plant.sampling_time, store_full_solution=False)
    mpc.set_param(nlpsol_opts={"print_time": 0, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9}})
    off, input_off = x - along, u - input_along
    mpc.set_objective(lterm=off.T @ Q @ off + input_off.T @ R @ input_off, mterm=0 * off.T @ off)
    for kind, name, bounds in (("_x", "x", plant.state_set), ("_u", "u", plant.input_set)):
        mpc.bounds["lower", kind, name] = [interval.lower for _, interval in bounds.intervals]
        mpc.bounds["upper", kind, name] = [interval.upper for _, interval in bounds.intervals]
    window, values = reference.window(0, horizon), mpc.get_tvp_template()
    for i in range(horizon + 1):
        values["_tvp", i, "x_r"] = window.states[i]
        values["_tvp", i, "u_r"] = window.inputs[min(i, horizon - 1)]
    mpc.set_tvp_fun(lambda now: values)
    _end_on_reference(mpc, horizon, n)

    def step(start: Array) -> Array:
        mpc.t0 = 0.0
        mpc.x0 = start
        mpc.u0 = window.inputs[0]
        mpc.set_initial_guess()
        return np.asarray(mpc.make_step(start)).ravel()

    return step


def _end_on_reference(mpc: Any, horizon: int, n: int) -> None:
    """The terminal equality, which do-mpc has no word for, joins its program by hand."""
    mpc.prepare_nlp()
    mpc.nlp_cons.append(mpc.opt_x["_x", horizon, 0, -1] * mpc._x_scaling.cat - mpc.opt_p["_tvp", horizon, "x_r"])
    mpc.nlp_cons_lb.append(np.zeros((n, 1)))
    mpc.nlp_cons_ub.append(np.zeros((n, 1)))
    mpc.create_nlp()
