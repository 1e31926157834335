"""References in do-mpc: the function that gives a controller or simulator its time-varying parameters.

do-mpc and CasADi are not imported: the user's controller makes the structures that are filled here.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from trackable.arguments import real
from trackable.arrays import Array, ArrayLike
from trackable.control.angles import angles_of
from trackable.exports.coordinates import continuous, places
from trackable.exports.proved import Proved, proved_times

Parameters = Mapping[str, str | Sequence[str]]
"""For each time-varying parameter of a model, the state or input that it holds, or several of them."""

TimeVarying = Callable[[ArrayLike], Any]

_OF_STEP = 1e-6  # by how much a controller's clock may be off its grid, in sampling times


def tvp_function(proved: Proved, controller: Any, parameters: Parameters | None, start: float) -> TimeVarying:
    """Return what `controller.set_tvp_fun` takes; see `Conventions.to_do_mpc`."""
    plant = proved.reference.plant
    step = real("to_do_mpc: t_step of the controller", controller.settings.t_step)
    if abs(step - plant.sampling_time) > 1e-12 * step:
        raise ValueError(
            f"to_do_mpc: the controller's t_step is {step:g} s, but the reference is proved for "
            f"T_s = {plant.sampling_time:g} s"
        )
    declared = [str(name) for name in list(controller.model.tvp.keys()) if name != "default"]
    columns = _columns(proved, declared, parameters)
    horizon = getattr(controller.settings, "n_horizon", None)
    begin = real("to_do_mpc: start", start)

    def tvp_fun(t_now: ArrayLike) -> Any:
        steps = _step(t_now, step) + np.arange(1.0 if horizon is None else horizon + 1.0)
        t = proved_times(proved, begin + steps * step)
        values = np.concatenate([_states(proved, begin, steps, t), proved.reference.input_at(t)], axis=-1)
        template = controller.get_tvp_template()
        for name, chosen in columns.items():
            for k, row in enumerate(values[:, chosen]):
                template[(name,) if horizon is None else ("_tvp", k, name)] = row
        return template

    return tvp_fun


def _states(proved: Proved, begin: float, steps: Array, t: Array) -> Array:
    """Return the states at times t [s], with angles that have not jumped since the controller's time zero."""
    if steps[0] <= 0 or not angles_of(proved.reference.plant):
        return continuous(proved, proved.reference.state_at(t))
    before = proved_times(proved, begin + np.arange(steps[0]) * proved.reference.plant.sampling_time)
    return continuous(proved, proved.reference.state_at(np.concatenate([before, t])))[len(before) :]


def _step(t_now: ArrayLike, step: float) -> float:
    """Return the step of the controller's clock, whose sums of T_s are rounded. ValueError: it is between two steps."""
    now = float(np.asarray(t_now, dtype=float).reshape(()))
    k = float(np.round(now / step))
    if abs(now / step - k) > _OF_STEP:
        raise ValueError(f"tvp_fun: t_now = {now:g} s is no multiple of T_s = {step:g} s")
    return k


def _columns(proved: Proved, declared: Sequence[str], parameters: Parameters | None) -> dict[str, Array]:
    """Return for each parameter the places of its values among the states and inputs.

    ValueError: a parameter or a name is unknown, or none of those that are expected is declared.
    """
    place = places(proved)
    if parameters is None:
        found: Parameters = {f"{name}_ref": name for name in place if f"{name}_ref" in declared}
        if not found:
            expected = ", ".join(f"{name}_ref" for name in place)
            raise ValueError(
                f"to_do_mpc: the model declares none of {expected} by set_variable('_tvp', …); or say which hold what: "
                "parameters={'x_ref': ['position', 'velocity']}"
            )
        parameters = found
    columns = {}
    for parameter, of in parameters.items():
        if parameter not in declared:
            raise ValueError(f"to_do_mpc: the model has no parameter {parameter}, only {', '.join(declared) or 'none'}")
        names = [of] if isinstance(of, str) else list(of)
        if unknown := [name for name in names if name not in place]:
            raise ValueError(f"to_do_mpc: {unknown[0]} is neither a state nor an input ({', '.join(place)})")
        columns[parameter] = np.array([place[name] for name in names])
    return columns
