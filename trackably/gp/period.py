"""The common period of kernels: if there is one, constraints on one period hold for all times."""

from collections.abc import Sequence

from trackably.gp.joint import JointPrior
from trackably.gp.kernels.base import Kernel


def common_period(kernels: Sequence[Kernel]) -> float | None:
    """Return the period [s] that all kernels have, as the same float64; None where there is none."""
    periods = {kernel.period for kernel in kernels}
    return periods.pop() if len(periods) == 1 else None


def period_of(kernels: Sequence[Kernel]) -> float:
    """Return the period [s] that all kernels have. Raises TypeError where there is none.

    Without a common period, constraints on a finite window say nothing about other times.
    """
    needed = "a guarantee for all times from one period needs"
    for kernel in kernels:
        if kernel.period is None:
            raise TypeError(f"{needed} a periodic kernel, got {type(kernel).__name__}")
    period = common_period(kernels)
    if period is None:
        raise TypeError(f"{needed} one for all signals, got {sorted(kernel.period or 0.0 for kernel in kernels)}")
    return period


def has_period(prior: JointPrior) -> bool:
    """Whether all kernels have one common period for all values of the learned hyperparameters."""
    names = [name for name in prior.hyperparameters if name.endswith("period")]
    is_known = not {*names} & {*prior.learned}
    return common_period([part.kernel for part in prior.parts]) is not None and (is_known or names == ["period"])
