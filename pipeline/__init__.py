"""Trackable: learn a reference from noisy samples, and guarantee that the controlled system can follow it.

What a notebook or a program needs comes from here, each name loaded when it is first asked for.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
"""The project's folder: parameters, data and results are named relative to it."""

_PUBLIC = {
    "ConstrainedSystem": "pipeline.systems.constrained",
    "Controller": "pipeline.control.controller",
    "Infeasible": "pipeline.control.answer",
    "Linear": "pipeline.systems.linear",
    "Matern32": "pipeline.gp.radial",
    "Matern52": "pipeline.gp.radial",
    "NotTrackableError": "pipeline.trackable",
    "Periodic": "pipeline.gp.periodic",
    "Polytope": "pipeline.systems.polytope",
    "Product": "pipeline.gp.combinations",
    "RationalQuadratic": "pipeline.gp.radial",
    "Samples": "pipeline.gp.samples",
    "SquaredExponential": "pipeline.gp.radial",
    "Sum": "pipeline.gp.combinations",
    "Step": "pipeline.control.answer",
    "TrackableReference": "pipeline.trackable",
    "learn_reference": "pipeline.tracking",
}
__all__ = ["ROOT", *_PUBLIC]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name in _PUBLIC:
        return getattr(import_module(_PUBLIC[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
