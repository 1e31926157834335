"""What a controller answers: an input, or why there is none."""

from dataclasses import dataclass
from enum import StrEnum

from trackable.arrays import Array


class Status(StrEnum):
    """How an optimum was found."""

    UNBOUNDED = "unbounded"
    """No bound is active: the optimum is linear in the error."""
    SOLVED = "solved"
    """Some bound is active: a quadratic program."""
    WIDENED = "widened"
    """Feasible only with all sets widened by less than the tolerance: they touch the reference, or rounding does."""
    KEPT = "kept"
    """Of a nonlinear system: the plan that the search began with, since none was found that costs less."""


@dataclass(frozen=True)
class Step:
    """The optimal plan at step `k`, and the `input` u(k) (m,) to apply: its first one.

    `cost` is V = Σ_(i<N) ‖x − x_r‖²_Q + ‖u − u_r‖²_R along the predicted `states` x(k), …, x(k+N) (N + 1, n) and
    `inputs` (N, m), and `stage_cost` its first term. `slack` is the smallest distance of these to a bound, as a part
    of the width between the bounds, never below minus the controller's tolerance; `landing` is what is left of
    max |x(k+N) − x_r(k+N)|.
    """

    k: int
    input: Array
    cost: float
    stage_cost: float
    states: Array
    inputs: Array
    slack: float
    landing: float
    status: Status

    @property
    def explanation(self) -> str:
        return f"at step {self.k} feasible ({self.status}), V = {self.cost:.4g}, slack {self.slack:.3g} of a width"


@dataclass(frozen=True)
class Infeasible:
    """At step `k` no admissible plan ends on the reference.

    `widening`: with all sets widened by this part of their widths, and no less, there is one; `quantity` is then at its
    widened bound at step `when`, first of all, `excess` (in its unit) outside. `miss` (n,): with the sets as they are,
    this is x(k+N) − x_r(k+N) of the plan that ends closest; None where not even the sets can be kept. `fallback` (m,)
    is the admissible input of that plan; of the widened one, pulled into the input set, where there is none.
    """

    k: int
    widening: float
    quantity: str
    when: int
    excess: float
    miss: Array | None
    fallback: Array

    @property
    def explanation(self) -> str:
        if self.miss is None:
            missed = "no plan at all keeps the sets"
        else:
            missed = f"a plan that keeps them misses the reference by {abs(self.miss).max():.3g}"
        return (
            f"at step {self.k} no plan ends on the reference: all bounds would have to move by {self.widening:.3g} of "
            f"their widths, and the {self.quantity} by {self.excess:.3g} at step {self.when}; {missed}"
        )


Answer = Step | Infeasible
