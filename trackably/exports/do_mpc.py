"""References in do-mpc: the function that supplies a controller or simulator with its time-varying parameters.

do-mpc and CasADi are not imported: the user's controller makes the structures that are filled here.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from trackably.arguments import real
from trackably.arrays import ArrayLike
from trackably.exports.proved import Proved, values_at

TimeVarying = Callable[[ArrayLike], Any]

_OF_STEP = 1e-6  # a clock that is this near to a step, in sampling times, is at the step


def tvp_function(proved: Proved, controller: Any, start: float) -> TimeVarying:
    """Return the argument of `controller.set_tvp_fun`; see `ProvedReference.to_do_mpc`."""
    plant = proved.reference.plant
    if not hasattr(controller, "settings"):
        raise TypeError(f"to_do_mpc: expected a controller or simulator of do-mpc, got {type(controller).__name__}")
    step = real("to_do_mpc: t_step of the controller", controller.settings.t_step)
    if abs(step - plant.sampling_time) > 1e-12 * step:
        raise ValueError(
            f"to_do_mpc: the controller's t_step must be the sampling time for which the reference is proved, "
            f"{plant.sampling_time:g} s, got {step:g} s"
        )
    expected, declared = {f"{name}_ref": name for name in plant.names}, {*controller.model.tvp.keys()}
    names = {parameter: name for parameter, name in expected.items() if parameter in declared}
    if not names:
        raise ValueError(
            f"to_do_mpc: the model declares none of {', '.join(expected)} by set_variable('_tvp', …); declare "
            "those that its cost needs"
        )
    horizon = getattr(controller.settings, "n_horizon", None)
    first = _nearby(real("to_do_mpc: start", start) / step)

    def tvp_fun(t_now: ArrayLike) -> Any:
        elapsed = _elapsed_steps(t_now, step)
        steps = first + elapsed + np.arange(1.0 if horizon is None else horizon + 1.0)
        # Angles are unwrapped from the controller's start on, so that they do not jump between calls.
        before = steps[0] - np.arange(elapsed, 0.0, -1.0) if plant.angles else steps[:0]
        every = np.concatenate([before, steps])
        values, template = values_at(proved, every), controller.get_tvp_template()
        for parameter, name in names.items():
            for k, value in enumerate(values[name][len(before) :].tolist()):
                template[(parameter,) if horizon is None else ("_tvp", k, parameter)] = value
        return template

    return tvp_fun


def _elapsed_steps(t_now: ArrayLike, step: float) -> float:
    """Return the number of steps since the controller's clock was zero. Its time `t_now` [s] is a sum of rounded T_s.

    ValueError: this is no whole number.
    """
    now = float(np.asarray(t_now, dtype=float).reshape(()))
    k = _nearby(now / step)
    if not k.is_integer():
        raise ValueError(f"tvp_fun: expected t_now as a multiple of T_s = {step:g} s, got {now:g} s")
    return k


def _nearby(steps: float) -> float:
    """Return the whole number nearest to a quotient of rounded times, if it is close; otherwise the quotient."""
    whole = float(np.round(steps))
    return whole if abs(steps - whole) <= _OF_STEP else steps
