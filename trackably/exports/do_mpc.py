"""References in do-mpc: the function that supplies a controller or simulator with its time-varying parameters.

do-mpc and CasADi are not imported: the user's controller makes the structures that are filled here.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from trackably.arguments import real
from trackably.arrays import ArrayLike
from trackably.exports.proved import Proved, require_known, values_at

Parameters = Mapping[str, str | Sequence[str]]
"""For each time-varying parameter of a model, the state or input that it holds, or several of them."""

TimeVarying = Callable[[ArrayLike], Any]

_OF_STEP = 1e-6  # a clock that is this near to a step, in sampling times, is at the step


def tvp_function(proved: Proved, controller: Any, parameters: Parameters | None, start: float) -> TimeVarying:
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
    declared = [str(name) for name in list(controller.model.tvp.keys()) if name != "default"]
    names = _names_held(proved, declared, parameters)
    horizon = getattr(controller.settings, "n_horizon", None)
    first = _nearby(real("to_do_mpc: start", start) / step)

    def tvp_fun(t_now: ArrayLike) -> Any:
        elapsed = _elapsed_steps(t_now, step)
        steps = first + elapsed + np.arange(1.0 if horizon is None else horizon + 1.0)
        # Angles are unwrapped from the controller's start on, so that they do not jump between calls.
        before = steps[0] - np.arange(elapsed, 0.0, -1.0) if plant.angles else steps[:0]
        every = np.concatenate([before, steps])
        values, template = values_at(proved, every), controller.get_tvp_template()
        for name, held in names.items():
            for k, row in enumerate(np.column_stack([values[of] for of in held])[len(before) :]):
                template[(name,) if horizon is None else ("_tvp", k, name)] = row
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


def _names_held(proved: Proved, declared: Sequence[str], parameters: Parameters | None) -> dict[str, list[str]]:
    """Return for each parameter the names of the states and inputs that it holds.

    ValueError: a parameter or a name is unknown, or none of the expected parameters is declared.
    """
    known = proved.reference.plant.names
    if parameters is None:
        parameters = {f"{name}_ref": name for name in known if f"{name}_ref" in declared}
        if not parameters:
            expected = ", ".join(f"{name}_ref" for name in known)
            raise ValueError(
                f"to_do_mpc: the model declares none of {expected} by set_variable('_tvp', …); declare one, or say "
                "what each parameter holds, as in parameters={'x_ref': ['position', 'velocity']}"
            )
    found = {parameter: [of] if isinstance(of, str) else list(of) for parameter, of in parameters.items()}
    for parameter, of in found.items():
        if parameter not in declared:
            raise ValueError(f"to_do_mpc: the model has no parameter {parameter}, only {', '.join(declared) or 'none'}")
        require_known("to_do_mpc", of, proved)
    return found
