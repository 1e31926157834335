"""Kernels and hyperparameters as written in params.yaml."""

import dataclasses

from trackably.gp.hyperparameter import hyperparameter
from trackably.gp.kernels.base import Kernel
from trackably.gp.kernels.elementary import Elementary
from trackably.gp.kernels.registry import KERNELS


def parse_kernel(written: object) -> Kernel:
    """Return the kernel that a mapping with a `type` describes: hyperparameters are known, learned, or left out.

    Raises ValueError, naming the field, for an unknown type, field or value.
    """
    if not isinstance(written, dict) or not isinstance(written.get("type"), str):
        raise ValueError(f"expected a mapping with a `type`, got {written!r}")
    if written["type"] not in KERNELS:
        raise ValueError(f"type: expected one of {', '.join(KERNELS)}, got {written['type']!r}")
    kernel = KERNELS[written["type"]]
    names = [field.name for field in dataclasses.fields(kernel)]
    if unknown := [name for name in written if name not in {"type", *names}]:
        raise ValueError(f"{unknown[0]}: not a field of this kernel; it has {', '.join(names)}")
    if issubclass(kernel, Elementary):
        return kernel(**{name: _named(name, value) for name, value in written.items() if name != "type"})
    return kernel(**{name: _part(name, written.get(name)) for name in names})


def parse_hyperparameter(written: object) -> float:
    """Return a positive number (known) or what is learned in [lower, upper]. ValueError for anything else."""
    try:
        return hyperparameter("nothing" if written is None else written)
    except ValueError as error:
        raise ValueError(f"expected {error}, got {written!r}") from None


def _named(name: str, written: object) -> float:
    try:
        return parse_hyperparameter(written)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _part(name: str, written: object) -> Kernel:
    try:
        return parse_kernel(written)
    except ValueError as error:
        of_field = str(error).partition(":")[0].replace(".", "").isidentifier()
        raise ValueError(f"{name}{'.' if of_field else ': '}{error}") from None
