"""The statement of a certificate about the disturbed system: its reference has slack for every
error in an invariant set.
"""

from dataclasses import dataclass

from trackably.systems.constrained import ConstrainedSystem, LinearConstraint
from trackably.systems.disturbances import Measured
from trackably.systems.tightening import InvariantSet, Tightening, WrongModel


@dataclass(frozen=True, eq=False)
class Robust:
    """For all w(k) ∈ W and starts in x_r ⊕ Z, u = u_r + K (x − x_r) keeps x and u in the `given` sets.

    The starts are at the times of the certificate's claim, and x and u are meant at every step after. Z is the
    `invariant` set. The statement holds because the certified reference keeps bounds that are tightened by h_Z(row) for
    states, and by h_Z(Kᵀ row) for inputs: the error e = x − x_r obeys e⁺ = (A + B K) e + w, and stays in Z. If the
    state is `measured` with noise, this holds for y = x + v, and x keeps the bounds less the noise set V.
    """

    given: ConstrainedSystem
    invariant: InvariantSet
    measured: Measured | None = None
    model: WrongModel | None = None

    @property
    def explanation(self) -> str:
        """The claim in a sentence."""
        states, inputs = (
            ", ".join(
                _bounds_text(constraint) for constraint in self.given.given_constraints if constraint.side == side
            )
            for side in ("state", "input")
        )
        kept = ", ".join(filter(None, (states, inputs)))
        W = (self.model or self.measured or self.invariant).disturbance
        seen, K = "y" if self.measured else "x", self.invariant.feedback.tolist()
        named = any(map(any, W.vectors)) or not (self.measured or self.model)
        under = [f"disturbance in {W}"] if named else []
        if self.measured:
            under.append(f"measurement noise in {self.measured.noise}")
        if self.model:
            under.append(f"plant in {self.model.error}")
        return (
            f"under every {' and '.join(under)}, from every start in x_r ⊕ Z at one of these times and for all later "
            f"steps among them, u = u_r + K ({seen} - x_r) with K = {K} keeps {kept}"
        )


def robust_of(tightening: Tightening | None) -> Robust | None:
    """Return the statement about the disturbed plant of a certificate for a tightened plant.

    None without disturbances.
    """
    if tightening is None or tightening.invariant is None:
        return None
    return Robust(tightening.given, tightening.invariant, tightening.measured, tightening.model)


def _bounds_text(constraint: LinearConstraint) -> str:
    return f"{constraint.name} in {constraint.bounds}"
