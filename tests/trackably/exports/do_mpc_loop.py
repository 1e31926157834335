"""A closed loop in do-mpc, built as its users build one: model, controller and simulator of a linear system."""

import warnings
from typing import Any

import numpy as np

from trackably import TrackableReference
from trackably.arrays import Array, ArrayLike

with warnings.catch_warnings():  # of parts of do-mpc that are not installed
    warnings.simplefilter("ignore")
    from do_mpc.controller import MPC
    from do_mpc.model import Model
    from do_mpc.simulator import Simulator

QUIET = {"ipopt.print_level": 0, "print_time": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-12}


def model_of(reference: TrackableReference, suffix: str = "_ref") -> Any:
    """The reference's linear system, with a time-varying parameter for each state and input."""
    system = reference.reference.plant.linear
    model = Model("discrete", "SX")
    x = [model.set_variable("_x", name) for name in system.states]
    u = [model.set_variable("_u", name) for name in system.inputs]
    for name in (*system.states, *system.inputs):
        model.set_variable("_tvp", f"{name}{suffix}")
    for i, name in enumerate(system.states):
        terms = [system.A[i, j] * x[j] for j in range(len(x))] + [system.B[i, j] * u[j] for j in range(len(u))]
        model.set_rhs(name, sum(terms) + float(system.c[i]))
    model.setup()
    return model


def controller_of(reference: TrackableReference, model: Any, horizon: int) -> Any:
    """A tracking controller with the plant's bounds, and without any terminal constraint."""
    plant = reference.reference.plant
    controller = MPC(model)
    controller.set_param(n_horizon=horizon, t_step=plant.sampling_time, store_full_solution=True, nlpsol_opts=QUIET)
    states = sum((model.x[name] - model.tvp[f"{name}_ref"]) ** 2 for name in plant.system.states)
    inputs = sum((model.u[name] - model.tvp[f"{name}_ref"]) ** 2 for name in plant.system.inputs)
    controller.set_objective(mterm=100 * states, lterm=states + 0.1 * inputs)
    controller.set_rterm(**dict.fromkeys(plant.system.inputs, 0.0))
    for kind, names, bounds in (
        ("_x", plant.system.states, plant.state_set),
        ("_u", plant.system.inputs, plant.input_set),
    ):
        for row, low, high in zip(bounds.rows, bounds.lower, bounds.upper, strict=True):
            i = int(np.flatnonzero(row)[0])
            controller.bounds["lower", kind, names[i]] = low / row[i]
            controller.bounds["upper", kind, names[i]] = high / row[i]
    controller.set_tvp_fun(reference.to_do_mpc(controller))
    controller.setup()
    return controller


def simulator_of(reference: TrackableReference, model: Any) -> Any:
    simulator = Simulator(model)
    simulator.set_param(t_step=reference.reference.plant.sampling_time)
    simulator.set_tvp_fun(reference.to_do_mpc(simulator))
    simulator.setup()
    return simulator


def loop(reference: TrackableReference, horizon: int, steps: int, off: ArrayLike = 0.0) -> tuple[Array, Array, Array]:
    """Return states (K + 1, n), inputs (K, m), and the error of the last predicted state of each step (K, n).

    The plant begins at the reference plus `off`.
    """
    model = model_of(reference)
    controller, simulator = controller_of(reference, model, horizon), simulator_of(reference, model)
    x = (reference.state(0) + off)[:, None]
    controller.x0 = simulator.x0 = x
    controller.set_initial_guess()
    states, inputs, ends = [x[:, 0]], [], []
    for k in range(steps):
        u = controller.make_step(x)
        last = np.array([float(controller.opt_x_num["_x", horizon, 0, 0, name]) * float(controller._x_scaling[name])
                         for name in reference.reference.plant.system.states])  # fmt: skip
        ends.append(last - reference.state(k + horizon))
        x = simulator.make_step(u)
        states.append(x[:, 0])
        inputs.append(u[:, 0])
    return np.array(states), np.array(inputs), np.array(ends)
