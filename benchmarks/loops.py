"""Times in a control loop: steps of controllers, windows that are learned and proved again, and checks of proofs."""

import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import cycle
from time import process_time

import numpy as np
from scipy.optimize import bisect

from benchmarks.disturbed import Case, experiments, random_systems
from benchmarks.harness import Row, agree, burst, duel, kept, within
from benchmarks.problems import box, integrator, posterior_mean
from pipeline.published.scalar import scalar
from trackably import Relearner, TrackableReference, learn_reference
from trackably.arrays import Array
from trackably.certificates.certificate import Certificate
from trackably.certificates.form import encode_certificate
from trackably.certificates.prove import prove
from trackably.checker import Proved, check
from trackably.checker.certificate import Window
from trackably.control.controller import Controller
from trackably.control.references import TabulatedReference
from trackably.control.stepping import Plan, Status
from trackably.control.tube import TubeController
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.matern import Matern52
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.samples import Samples
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.intervals import Interval
from trackably.systems.linear import LinearSystem
from trackably.systems.reference import Reference

HORIZON = 20


def rows() -> Iterator[Row]:
    """Yield rows for steps of the nominal and of the tube controller, windows, and checks."""
    for count in (1, 2):
        yield from _nominal(count)
    yield from _tube()
    narrow = scalar(0.9, 0.5, state_set=Interval(-2.0, 0.05), input_set=Interval(-0.5, 0.5), sampling_time=0.01)
    yield from _windows("Example 1's system", narrow, 0.1, lambda t: -0.6 + 0.55 * np.sin(np.pi * t / 2))
    yield from _windows("double integrator", integrator(1.0, 1.4, 2.0), 0.2, lambda t: np.sin(2 * np.pi * t / 4.5))
    for name, kernel, count, rate in (
        ("n = 249, squared exponential", SquaredExponential(1.0, 0.7), 249, 10.0),
        ("n = 249, Matérn 5/2", Matern52(1.0, 1.5), 249, 10.0),
        ("n = 270, quasi-periodic", Periodic(1.0, 1.0, 5.0) * SquaredExponential(1.0, 30.0), 270, 2.0),
        ("n = 1000, squared exponential", SquaredExponential(1.0, 0.7), 1000, 10.0),
    ):
        yield _check(name, kernel, count, rate)


_STARTS, _DRAWS = 40, 400


def masses(count: int) -> ConstrainedSystem:
    """Return `count` carts on a rail with independent accelerations: two states and one input for each cart."""
    A, B = (np.asarray(np.kron(np.eye(count), block), dtype=float) for block in ([[0, 1], [0, 0]], [[0], [1]]))
    return ConstrainedSystem(LinearSystem.discretised(A, B, 0.05), box([1.2, 2.0] * count), box([4.0] * count))


def sine(plant: ConstrainedSystem) -> Reference:
    """Return a reference of sines with 25 centres for each signal, as if learned from 25 samples."""
    times = np.linspace(0, 6, 25)
    samples = Samples(times, 0.8 * np.sin(1.5 * times))
    return Reference(posterior_mean(SquaredExponential(1.0, 0.6), 1e-3**0.5, samples) * plant.signal_count, plant)


def _nominal(count: int) -> Iterator[Row]:
    """Yield rows for a step with active bounds, from several states in turn, and for a step without active bounds.

    The rivals are the same step with a controller that is built anew each time, and do-mpc.
    """
    plant, n = masses(count), 2 * count
    reference, rng = sine(plant), np.random.default_rng(0)
    controller = Controller(plant, HORIZON, np.eye(n), 0.1 * np.eye(count))
    starts = [reference.state(0) + rng.uniform(0.01, 1.5) * rng.standard_normal(n) for _ in range(_DRAWS)]
    plans = [(start, controller.step(0, start, reference)) for start in starts]
    theirs = do_mpc_step(plant, reference, controller)
    for status, active in ((Status.SOLVED, "bounds"), (Status.NO_ACTIVE_BOUND, "no bound")):
        some = [(start, plan) for start, plan in plans if isinstance(plan, Plan) and plan.status is status][:_STARTS]
        if status is Status.SOLVED:
            for start, plan in some:
                agree("controller, first input", float(np.linalg.norm(plan.input - theirs(start))), 0.0, 1e-4)
        ways: tuple[Callable[[Array], object], ...] = (
            lambda start: controller.step(0, start, reference),
            # Without cached properties, the controller has to build its programs again.
            lambda start: replace(controller).step(0, start, reference),
            theirs,
        )
        ours, afresh, other = (partial(_next, way, cycle([start for start, _ in some])) for way in ways)
        problem = f"{n} states, horizon {HORIZON}, {active} active"
        yield duel("one step of the controller", problem, "built afresh", ours, afresh, rounds=3)
        yield duel("one step of the controller", problem, "do-mpc", ours, other, rounds=5)


def _next(step: Callable[[Array], object], starts: Iterator[Array]) -> object:
    return step(next(starts))


def do_mpc_step(plant: ConstrainedSystem, reference: Reference, like: Controller) -> Callable[[Array], Array]:
    """Build the same problem in do-mpc, and return a function from a state at step 0 to the plan's first input."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # do-mpc warns of optional packages that are not installed
        from do_mpc.controller import MPC
        from do_mpc.model import Model

    system, horizon = plant.linear, like.horizon
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
    mpc.set_objective(lterm=off.T @ like.Q @ off + input_off.T @ like.R @ input_off, mterm=0 * off.T @ off)
    for kind, name, bounds in (("_x", "x", plant.state_set), ("_u", "u", plant.input_set)):
        mpc.bounds["lower", kind, name] = [interval.lower for interval in bounds.bounds]
        mpc.bounds["upper", kind, name] = [interval.upper for interval in bounds.bounds]
    window, values = reference.window(0, horizon), mpc.get_tvp_template()
    for i in range(horizon + 1):
        values["_tvp", i, "x_r"] = window.states[i]
        values["_tvp", i, "u_r"] = window.inputs[min(i, horizon - 1)]
    mpc.set_tvp_fun(lambda now: values)
    # do-mpc has no terminal equality, so that it is added to its program here.
    mpc.prepare_nlp()
    mpc.nlp_cons.append(mpc.opt_x["_x", horizon, 0, -1] * mpc._x_scaling.cat - mpc.opt_p["_tvp", horizon, "x_r"])
    mpc.nlp_cons_lb.append(np.zeros((n, 1)))
    mpc.nlp_cons_ub.append(np.zeros((n, 1)))
    mpc.create_nlp()

    def step(start: Array) -> Array:
        mpc.t0 = 0.0
        mpc.x0 = start
        mpc.u0 = window.inputs[0]
        mpc.set_initial_guess()
        return np.asarray(mpc.make_step(start)).ravel()

    return step


_FIRST, _RANDOM, _STATES = 30, 8, 12
_CALLS, _ROUNDS = 10, 3
_TARGET = 3.0
_DISTANCES = {"in the tube": (0.3, 0.9), "near the tube": (1.05, 1.6), "far off": (2.0, 20.0)}
"""Distances of states from the reference, in parts of the way to the edge of the tube."""
_ENDS = {
    "no bound is active": ([Status.NO_ACTIVE_BOUND, Status.NO_ACTIVE_BOUND], _TARGET),
    "bounds are active": ([Status.SOLVED, Status.SOLVED], _TARGET),
    "only tightened bounds are active": ([Status.SOLVED, Status.NO_ACTIVE_BOUND], None),
}
"""For the statuses of the tube controller's and of the nominal step (no program, or a program solved): the target."""


def _tube() -> Iterator[Row]:
    """Yield rows with medians over states, for each experiment with disturbances and for all random systems."""
    cases = {case.name: [case] for case in experiments()}
    cases["random systems"] = list(random_systems(_RANDOM))
    note = "with a table of the reference; the range ends at the 95th percentile"
    for name, some in cases.items():
        steps = [step for case in some for step in _steps(case)]
        for distance in _DISTANCES:
            for how, (ends, target) in _ENDS.items():
                times = np.array([taken for at, ended, taken in steps if (at, ended) == (distance, ends)])
                if len(times):
                    lowest, middle, latest = np.quantile(times[:, 0] / times[:, 1], [0.0, 0.5, 0.95]).tolist()
                    problem = f"{name}, {distance}, {how}, {len(times)} states"
                    found = *np.median(times, axis=0).tolist(), middle, lowest, latest
                    topic, rival = "one step of the tube controller", "nominal controller"
                    yield Row(topic, problem, rival, *found, target, at_most=True, note=note)


def _steps(case: Case) -> Iterator[tuple[str, list[Status], list[float]]]:
    """Yield for each state its distance, the statuses of both steps, and their times [s], the least of some rounds."""
    nominal = Controller(case.tightening.given, HORIZON)
    tube = TubeController(case.tightening, HORIZON, nominal.Q, nominal.R)
    reference = TabulatedReference.of(case.robust, _FIRST, _FIRST + HORIZON)
    rng = np.random.default_rng(0)
    for distance, (least, most) in _DISTANCES.items():
        for _ in range(_STATES):
            direction = rng.standard_normal(len(nominal.Q)) / np.sqrt(np.diag(nominal.Q))
            off = rng.uniform(least, most) * _edge(tube, direction)
            state = reference.window(_FIRST, 1).states[0] + off
            steps = [partial(of.step, _FIRST, state, reference) for of in (tube, nominal)]
            plans = [step() for step in steps]
            times = [[burst(step, _CALLS) for step in steps] for _ in range(_ROUNDS)]
            ended = [plan.status for plan in plans if isinstance(plan, Plan)]
            yield distance, ended, np.min(times, axis=0).tolist()


def _edge(tube: TubeController, direction: Array) -> Array:
    """Return the error on the boundary of the invariant set Z in a direction."""
    outside = 1.0
    while tube.errors.contains(outside * direction):
        outside *= 2
    return direction * bisect(lambda part: tube.errors.contains(part * direction) - 0.5, 0.0, outside, rtol=1e-3)


_WINDOWS, _COUNT = 100, 30
_BUDGETS = (("median", 0.5, 0.010), ("99th percentile", 0.99, 0.020))  # name, quantile, budget in seconds


def _windows(name: str, plant: ConstrainedSystem, step: float, truth: Callable[[Array], Array]) -> Iterator[Row]:
    """Yield rows for windows that are learned and proved again; each window is one sample later than the last one.

    Hyperparameters are those of the first window.
    """
    times = step * np.arange(_COUNT + _WINDOWS)
    values = truth(times) + 0.02 * np.random.default_rng(0).standard_normal(times.size)
    windows = [Samples(times[i : i + _COUNT], values[i : i + _COUNT]) for i in range(_WINDOWS)]
    first = learn_reference(windows[0], plant, SquaredExponential(), "all_times", mean=0.0, starts=2, progress=False)
    for moving_every, what in ((0, "function alone"), (1, "hyperparameters too")):
        learner = Relearner(first, clock=process_time, moving_every=moving_every)
        certified = sum(isinstance(learner(samples), TrackableReference) for samples in windows[1:])
        note = f"{what}, {certified} of {_WINDOWS - 1} windows certified"
        for said, quantile, budget in _BUDGETS:
            taken, target = float(np.quantile(learner.seconds[1:], quantile)), None if moving_every else 1.0
            yield within("windows learned again", f"{name}, n = {_COUNT}, {what}, {said}", taken, budget, note, target)


_NOISE, _MARGIN = 0.1, 1.02


def _check(name: str, kernel: Kernel, count: int, rate: float) -> Row:
    """Return a row for the check of a proof: a posterior mean of noisy sines, with bounds 2 % wider than its range."""
    rng = np.random.default_rng(0)
    times = np.sort(rng.uniform(0, count / rate, count))
    values = np.sin(2 * np.pi * times / 5) + 0.3 * np.sin(2 * np.pi * times / 3.3) + _NOISE * rng.standard_normal(count)
    signals = posterior_mean(kernel, _NOISE, Samples(times, values))
    fine = np.linspace(0, count / rate, 40 * count)
    free = Reference(signals, integrator(1e3, 1e3, 1e3))
    sizes = [_MARGIN * float(np.max(np.abs(q(signals, fine)))) for q in free.quantities]
    reference = Reference(signals, integrator(*sizes))

    def proof() -> Certificate:
        return kept(prove(reference, Window(0.0, count / rate)), Certificate)

    data = encode_certificate(proof())
    return duel(
        "checks",
        name,
        "own proof",
        lambda: check(data),
        proof,
        rounds=3,
        target=5.0,
        at_most=True,
        check=lambda: kept(check(data), Proved),
    )
