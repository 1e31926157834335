"""Several processes, each with samples of its own, that are learned together."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property as cached
from typing import Self

import numpy as np

from trackably.arrays import Array, root_mean_square
from trackably.gp.hyperparameter import Combined, Learned
from trackably.gp.kernels.base import Kernel
from trackably.gp.posterior import Posterior
from trackably.gp.prior import NOISE, Prior
from trackably.gp.samples import Samples
from trackably.gp.signal import KernelSum


@dataclass(frozen=True)
class JointPrior(Combined):
    """Independent processes with `names`, each with its prior; hyperparameters named in `shared` are the same for all.

    A hyperparameter is called `<process>.<name>`, or just `<name>` if it is shared or if there is only one process.
    ValueError: names repeat, a shared hyperparameter is unknown, or it is not the same in all priors.
    """

    parts: tuple[Prior, ...]
    names: tuple[str, ...] = ("",)
    shared: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not 0 < len(self.parts) == len(self.names) == len({*self.names}):
            raise ValueError(
                f"prior: every process needs a different name, got {self.names}; the number of processes is "
                f"{len(self.parts)}"
            )
        for name in sorted(self.shared):
            values = [part.hyperparameters[name] for part in self.parts if name in part.hyperparameters]
            if not values:
                raise ValueError(f"prior: {name} is shared, but no process has a hyperparameter of that name")
            if len({(v, v.interval if isinstance(v, Learned) else ()) for v in values}) > 1:
                raise ValueError(
                    f"prior: {name} is shared, but its values or intervals differ between processes; give all the same "
                    f"{name}"
                )

    @property
    def named_parts(self) -> dict[str, Prior]:
        return dict(zip(self.names, self.parts, strict=True))

    def with_parts(self, parts: Iterable[Prior]) -> Self:
        """Return the joint prior with other priors of the processes."""
        return type(self)(tuple(parts), self.names, self.shared)

    def name_of(self, part: str, name: str) -> str:
        plain = len(self.parts) == 1 or name in self.shared
        return name if plain else f"{part}.{name}"

    @property
    def log_hyperparameters(self) -> Array:
        """ln θ of the learned hyperparameters, shape (p,)."""
        return np.log([self.hyperparameters[name] for name in self.learned])

    def with_log_hyperparameters(self, log_theta: Array) -> Self:
        """Return the prior at ln θ of the learned hyperparameters, shape (p,): the inverse of `log_hyperparameters`."""
        return self.with_hyperparameters(dict(zip(self.learned, np.exp(log_theta).tolist(), strict=True)))

    @cached
    def places(self) -> tuple[list[int], ...]:
        """For each process, the indices of its learned hyperparameters among all learned ones."""
        return tuple(
            [self.learned.index(self.name_of(process, name)) for name in part.learned]
            for process, part in self.named_parts.items()
        )


@dataclass(frozen=True)
class JointPosterior:
    """Posteriors of all processes; `bases` are prior means that are functions (see `Posterior`).

    Raises IllConditioned, on first use, if K + σ_n² I of a process cannot be factored.
    """

    prior: JointPrior
    samples: tuple[Samples, ...]
    bases: tuple[KernelSum, ...] = ()

    @cached
    def parts(self) -> tuple[Posterior, ...]:
        each = zip(self.prior.parts, self.samples, self.bases or [None] * len(self.samples), strict=True)
        return tuple([Posterior(*of) for of in each])

    @cached
    def signals(self) -> tuple[KernelSum, ...]:
        """The posterior means of the processes as functions of time."""
        return tuple(part.signal for part in self.parts)

    def negative_log_marginal_likelihood(self) -> tuple[float, Array]:
        """Return the sum of l over the processes, and ∂/∂ln θ of the learned hyperparameters, shape (p,)."""
        total, gradient = 0.0, np.zeros(len(self.prior.learned))
        for part, places in zip(self.parts, self.prior.places, strict=True):
            value, by_own = part.negative_log_marginal_likelihood()
            total += value
            gradient[places] += by_own
        return total, gradient

    @property
    def information(self) -> Array:
        """An approximate Hessian of the summed l in ln θ of the learned hyperparameters, shape (p, p).

        It is the sum of `Posterior.information` over the processes.
        """
        total = np.zeros((len(self.prior.learned), len(self.prior.learned)))
        for part, places in zip(self.parts, self.prior.places, strict=True):
            total[np.ix_(places, places)] += part.information
        return total

    def with_likeliest_means(self, between: Sequence[tuple[float, float] | None]) -> "JointPosterior":
        """Return the posterior with each prior mean at its most likely value in an interval; None keeps the mean."""
        pairs = zip(self.parts, between, strict=True)
        parts = tuple(part.with_likeliest_mean(*ends) if ends else part for part, ends in pairs)
        moved = JointPosterior(self.prior.with_parts(part.prior for part in parts), self.samples)
        vars(moved)["parts"] = parts  # with their factorisations, which do not depend on the means
        return moved

    def log_theta_with_noise(self, signals: Sequence[Callable[[Array], Array]]) -> Array:
        """Return ln θ of the learned hyperparameters, shape (p,), with noise that explains other `signals`.

        Each learned σ_n is multiplied by the same factor: the root mean square of the samples' distance from these
        signals, in units of the present noise; by 1 if this is smaller.
        """
        pairs = zip(self.parts, signals, strict=True)
        factor = max(1.0, root_mean_square(np.concatenate([part.residuals_of(signal) for part, signal in pairs])))
        is_noise = np.array([name.endswith(NOISE) for name in self.prior.learned])
        return np.asarray(self.prior.log_hyperparameters + np.log(factor) * is_noise)

    def jets(self, process: int, t: Array, order: int) -> Array:
        """Return the mean of one process, then its ∂/∂ln θ_j of all p learned hyperparameters, at times t [s].

        Each comes with its time derivatives up to `order`; the shape is (1 + p, order + 1, *t.shape).
        """
        own = self.parts[process].jets(t, order)
        found = np.zeros((1 + len(self.prior.learned), *own.shape[1:]))
        found[0] = own[0]
        found[1:][self.prior.places[process]] = own[1:]
        return found


# The common period of kernels. If there is one, constraints that hold during one period hold at all times.


def common_period(kernels: Sequence[Kernel]) -> float | None:
    """Return the period [s] that all kernels have, as the same float64; None if there is none."""
    periods = {kernel.period for kernel in kernels}
    return periods.pop() if len(periods) == 1 else None


def period_of(kernels: Sequence[Kernel]) -> float:
    """Return the period [s] that all kernels have. Raises TypeError if there is none.

    Without a common period, constraints on a finite window say nothing about other times.
    """
    period = common_period(kernels)
    if period is None:
        raise TypeError(
            "a guarantee for all times from one period needs a periodic kernel, with the same period for all signals, "
            f"got {', '.join(f'{type(kernel).__name__} with the period {kernel.period}' for kernel in kernels)}"
        )
    return period


def has_period(prior: JointPrior) -> bool:
    """Whether all kernels have one common period for all values of the learned hyperparameters."""
    names = [name for name in prior.hyperparameters if name.endswith("period")]
    is_known = not {*names} & {*prior.learned}
    return common_period([part.kernel for part in prior.parts]) is not None and (is_known or names == ["period"])
