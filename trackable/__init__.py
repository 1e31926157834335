"""Trackable: learn a reference from noisy samples, and guarantee that the controlled system can follow it.

What a notebook or a program needs comes from here, each name loaded when it is first asked for.
"""

from importlib import import_module
from typing import Any

_PUBLIC = {
    "ConstrainedSystem": "trackable.systems.constrained",
    "Controller": "trackable.control.controller",
    "Infeasible": "trackable.control.step.result",
    "LinearSystem": "trackable.systems.linear",
    "Matern32": "trackable.gp.kernels.matern",
    "Matern52": "trackable.gp.kernels.matern",
    "NotTrackableError": "trackable.reference",
    "Periodic": "trackable.gp.kernels.periodic",
    "Plan": "trackable.control.step.result",
    "Polytope": "trackable.systems.sets.polytope",
    "Product": "trackable.gp.kernels.base",
    "RationalQuadratic": "trackable.gp.kernels.rational_quadratic",
    "Samples": "trackable.gp.samples",
    "SquaredExponential": "trackable.gp.kernels.squared_exponential",
    "Sum": "trackable.gp.kernels.base",
    "TrackableReference": "trackable.reference",
    "learn_reference": "trackable.learn",
    "simulate": "trackable.control.simulation",
}
__all__ = [*_PUBLIC]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
