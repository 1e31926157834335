"""The result of a method: a learned reference; and the iterations of Algorithm 1 as arrays."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from trackably.arrays import Array
from trackably.gp.joint import JointPrior
from trackably.learning.problem import ActiveBound, Solution
from trackably.learning.published.algorithm1 import Iteration
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.reference import Reference


@dataclass(frozen=True)
class LearnedReference:
    """The result of a method: the reference, the `prior` with the learned hyperparameters, and its `objective` J.

    J = l + D, where D is what the `active_bounds` cost. Without them the reference is the posterior mean, and J = l.
    `method` is the method's name. `final_step` is k̄ at the end of Algorithm 1, `fits` is the number of nonlinear
    programs that were solved; each is None for methods without it.
    """

    method: str
    prior: JointPrior
    reference: Reference
    objective: float
    active_bounds: tuple[ActiveBound, ...] = ()
    final_step: int | None = None
    fits: int | None = None

    @classmethod
    def of(
        cls,
        method: str,
        solution: Solution,
        plant: ConstrainedSystem,
        *,
        final_step: int | None = None,
        fits: int | None = None,
    ) -> Self:
        prior, reference = solution.posterior.prior, Reference(solution.signals, plant)
        return cls(method, prior, reference, solution.objective, solution.active_bounds, final_step, fits)

    @property
    def price_of_bounds(self) -> float:
        """D, what the bounds cost for the learned hyperparameters."""
        return sum((bound.price for bound in self.active_bounds), start=0.0)

    @property
    def nlml(self) -> float:
        """l, the negative log marginal likelihood of the learned hyperparameters."""
        return self.objective - self.price_of_bounds


@dataclass(frozen=True)
class Trace:
    """The iterations of Algorithm 1, one array entry each. Bounds are NaN while the ζ-test fails; tests are 0 or 1.

    `mean_bound` m̄ is in the unit of the state, `derivative_bound` and the growth rates are per second.
    """

    k_bar: Array
    hyperparameters: dict[str, Array]
    objective: Array
    mean_bound: Array
    growth_lower: Array
    growth_upper: Array
    derivative_bound: Array
    keeps_states: Array
    keeps_rates: Array

    @classmethod
    def of(cls, iterations: tuple[Iteration, ...]) -> Self:
        priors = [i.solution.posterior.prior for i in iterations]
        names = priors[0].learned if priors else ()
        return cls(
            k_bar=np.array([i.k_bar for i in iterations], dtype=float),
            hyperparameters={name: np.array([p.hyperparameters[name] for p in priors]) for name in names},
            objective=np.array([i.solution.objective for i in iterations]),
            mean_bound=np.array([i.tail.mean_bound if i.tail else np.nan for i in iterations]),
            growth_lower=np.array([i.growth_rates[0] if i.growth_rates else np.nan for i in iterations]),
            growth_upper=np.array([i.growth_rates[1] if i.growth_rates else np.nan for i in iterations]),
            derivative_bound=np.array([i.tail.derivative_bound if i.tail else np.nan for i in iterations]),
            keeps_states=np.array([i.keeps_states for i in iterations], dtype=float),
            keeps_rates=np.array([i.keeps_rates for i in iterations], dtype=float),
        )

    @classmethod
    def from_columns(cls, columns: Mapping[str, Array]) -> Self:
        """Invert `columns`: a column that is not a field of a trace is a hyperparameter."""
        own = {field.name for field in fields(cls)}
        hyperparameters = {name: values for name, values in columns.items() if name not in own}
        return cls(hyperparameters=hyperparameters, **{name: v for name, v in columns.items() if name in own})

    def columns(self) -> dict[str, Array]:
        """Return all arrays by name, in the order of a table."""
        return {
            "k_bar": self.k_bar,
            **self.hyperparameters,
            "mean_bound": self.mean_bound,
            "growth_lower": self.growth_lower,
            "growth_upper": self.growth_upper,
            "derivative_bound": self.derivative_bound,
            "objective": self.objective,
            "keeps_states": self.keeps_states,
            "keeps_rates": self.keeps_rates,
        }
