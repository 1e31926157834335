"""The prior of each sampled name: its kernel, its noise and its mean, given for all names or by name."""

from collections.abc import Iterable, Mapping
from typing import TypeVar

from trackably.arguments import real
from trackably.gp.kernels.base import Kernel
from trackably.gp.prior import Prior

T = TypeVar("T")

Noise = float | tuple[float, float] | Mapping[str, float | tuple[float, float] | None] | None
"""σ_n of samples, given like a hyperparameter, for all names or by name."""


def priors_by_name(
    names: Iterable[str],
    kernel: Kernel | Mapping[str, Kernel],
    noise_std: Noise,
    mean: float | Mapping[str, float],
) -> dict[str, Prior]:
    """Return the prior of each name. TypeError or ValueError with the name in question:
    something is invalid or missing.
    """
    names = tuple(names)
    for what, given in (("kernel", kernel), ("noise_std", noise_std), ("mean", mean)):
        _refuse_unknown(what, given, names)
    return {
        name: _prior(
            name, value_of(kernel, name, "kernel"), value_of(noise_std, name, "noise_std"), value_of(mean, name, "mean")
        )
        for name in names
    }


def value_of(given: T | Mapping[str, T], name: str, what: str) -> T:
    """Return the value for a name, given for all names or by name. ValueError: `what` is missing for it."""
    if not isinstance(given, Mapping):
        return given
    if name not in given:
        raise ValueError(f"{what}: is missing for {name}, given for {', '.join(map(str, given)) or 'none'}")
    return given[name]


def _prior(name: str, kernel: object, noise_std: float | tuple[float, float] | None, mean: float) -> Prior:
    if not isinstance(kernel, Kernel):
        what = f"the class {kernel.__name__}" if isinstance(kernel, type) else type(kernel).__name__
        raise TypeError(f"kernel: expected a kernel such as SquaredExponential(), got {what}")
    try:
        return Prior(kernel, noise_std, real(f"mean of {name}", mean))
    except ValueError as error:
        raise ValueError(f"{error}{'' if name in str(error) else f' for {name}'}") from None


def _refuse_unknown(what: str, given: object, names: tuple[str, ...]) -> None:
    """Raise ValueError for a value of a name that is not sampled, because it would be ignored silently."""
    if isinstance(given, Mapping) and set(names) < set(given):
        unknown = next(name for name in given if name not in names)
        raise ValueError(f"{what}: is given for {unknown}, expected for {', '.join(names)} only")
