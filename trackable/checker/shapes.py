"""What a certificate has to look like."""

from typing import Any

from trackable.checker.formulas import formula
from trackable.checker.reading import (
    a_name,
    one_of,
    only,
    positive_number,
    rational_number,
    read,
    real_number,
    whole_number,
)

_RADIAL = {"signal_std": positive_number, "lengthscale": positive_number}
KERNELS: dict[str, dict[str, Any]] = {
    "SquaredExponential": _RADIAL,
    "Matern32": _RADIAL,
    "Matern52": _RADIAL,
    "RationalQuadratic": {**_RADIAL, "shape": positive_number},
    "Periodic": {**_RADIAL, "period": positive_number},
}
_kernel = one_of("type", KERNELS)
KERNELS |= {"Sum": {"left": _kernel, "right": _kernel}, "Product": {"left": _kernel, "right": _kernel}}

_BOXES = {"ends": [real_number], "radii": [positive_number]}
_COVERS = {"covers": {...: _BOXES}, "terms": whole_number}
_FUNCTIONAL = {"offset": rational_number, "weights": [[rational_number]]}
_ENDS = {"lower": real_number, "upper": real_number}
_BOUND = {"name": a_name, "row": [real_number], **_ENDS}
_NEEDED = {"name": a_name, "row": [rational_number], **_ENDS}
_ABOUT_SYSTEM = {"states": [a_name], "inputs": [a_name], "sampling_time": positive_number}
_EVERY = {
    "format": only("trackable certificate"),
    "version": only(2),
    "signals": [{"kernel": _kernel, "mean": real_number, "centres": [real_number], "weights": [real_number]}],
    "bounds": [one_of("of", {"state": _BOUND, "input": _BOUND})],
    "evaluation": {"until": positive_number, "errors": {...: positive_number}},
    "claim": one_of(
        "kind",
        {
            "all_times": {"tail_start": positive_number, **_COVERS},
            "all_phases": {"period": positive_number, **_COVERS},
            "window": {"start": real_number, "end": real_number, **_COVERS},
            "instants": {"last_step": whole_number},
        },
    ),
}
_LINEAR = {
    **_EVERY,
    "system": {"A": [[real_number]], "B": [[real_number]], "c": [real_number], **_ABOUT_SYSTEM},
    "trajectories": {"states": [_FUNCTIONAL], "inputs": [_FUNCTIONAL]},
}
_REDUNDANT = {
    **_LINEAR,
    "bounds": [one_of("of", {"state": _BOUND, "input": _NEEDED})],
    "input_set": [{"row": [real_number], **_ENDS}],
}
_NONLINEAR = {**_EVERY, "system": {"f": [formula], **_ABOUT_SYSTEM}}


def read_certificate(data: object) -> Any:
    """The certificate of a linear system, one with redundant inputs, or a nonlinear one. UnreadableError otherwise."""
    system = data.get("system") if isinstance(data, dict) else None
    if isinstance(system, dict) and "f" in system:
        return read(data, _NONLINEAR, "certificate")
    return read(data, _REDUNDANT if isinstance(data, dict) and "input_set" in data else _LINEAR, "certificate")
