"""Trackably: learn a reference from noisy samples, and guarantee that the controlled system can follow it.

The public names, by task:

- samples: `Samples`, or recordings by `read_csv`, `read_mcap` and `read_parquet`
- the plant: a `ConstrainedSystem` of a `LinearSystem` or a `NonlinearSystem`, and of sets such as `Polytope.box`
- the prior: kernels such as `SquaredExponential` and `Periodic`, which add and multiply
- learning with a proof: `learn_reference`, `learn_stream` for long recordings, `learn_many` for many of them
- what is known of the true signal: `Truth`, which learning takes
- trajectories from elsewhere: `certify`, `repair`, `certify_table`
- trajectories of robots: `Joints`, `JointTrajectory`, `certify_joints`, `repair_joints`, `stretch_joints`, `Gate`
- a plant that is not known exactly: `ModelError`, and `worst_plant` to search for one that breaks a bound
- proofs that others hand over: `check`
- control: `Controller`, `TubeController`, `simulate`, and `Relearner` to learn in the loop

A name is loaded when it is first used. If a package is missing, the error names the extra that installs it.
"""

import re
from importlib import import_module
from pathlib import Path
from typing import Any

__version__ = "0.2.0"

_PUBLIC = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_MODULES = {name: module for module, name in re.findall(r"^from (\S+) import (\w+) as", _PUBLIC, re.MULTILINE)}
"""The module of each public name: the one from which `__init__.pyi`, which type checkers read, imports it."""

__all__ = [*_MODULES]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from trackably.extras import optional  # noqa: PLC0415  a bundle of the checker lacks this module

    with optional(name):
        value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
