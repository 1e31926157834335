"""Check that the prior mean can be followed for as long as the claim requires."""

from trackably.checker.certificate import AllPhases, AllTimes, Claim, Window
from trackably.gp.joint import JointPrior
from trackably.systems.constrained import ConstrainedSystem
from trackably.systems.polytopes import ends_shown
from trackably.systems.tightening import Tightening
from trackably.systems.trajectories import Quantity


def refuse_mean(claim: Claim, prior: JointPrior, plant: ConstrainedSystem, drawn_in: Tightening | None = None) -> None:
    """Raise ValueError if the claim needs the prior mean to be followed for ever, and this is not possible.

    If the bounds of the plant were tightened, `drawn_in` is the tightening.
    """
    if quantities_at_rest(claim, plant):
        why = "what fades to it" if isinstance(claim, AllTimes) else "what swings about it"
        check_rest(prior, plant, drawn_in, f"{why} could not be followed for ever", ", or claim a window (start, end)")


def quantities_at_rest(claim: Claim, plant: ConstrainedSystem) -> tuple[Quantity, ...]:
    """Return the quantities that have to keep their bounds while the prior mean is held for ever, for this claim."""
    # A vehicle may move for ever: it has to come to rest only where the kernel decays.
    is_free = isinstance(claim, Window) or (plant.flat_form and isinstance(claim, AllPhases))
    return () if is_free else plant.quantities


def check_rest(
    prior: JointPrior, plant: ConstrainedSystem, drawn_in: Tightening | None, why: str, or_else: str = ""
) -> None:
    """Raise ValueError if the prior mean is no equilibrium inside the bounds.

    The message gives the reason `why` it has to be one, and an alternative, `or_else`.
    """
    means = [part.mean for part in prior.parts]
    for quantity in plant.quantities:
        level = quantity.bounds.rest.snapped(quantity.at_rest(means))
        if not quantity.bounds.rest.strictly_contains(level):
            left = _remaining_text(quantity, drawn_in) if drawn_in else ""
            said = f"{_place_text(quantity, level, why, or_else)}{_instead(quantity, level, prior)}{left}"
            raise ValueError(f"mean: must be an admissible equilibrium, but at rest there {said}")


def _remaining_text(quantity: Quantity, drawn_in: Tightening) -> str:
    """Return the given bounds as text, if disturbances, noise or a margin have tightened them."""
    given = {whole.name: whole.bounds for whole in drawn_in.given.quantities}.get(quantity.name, quantity.bounds)
    return "" if given == quantity.bounds else f"; disturbance, noise and margin leave no more of {given}"


def _instead(quantity: Quantity, level: float, prior: JointPrior) -> str:
    """Suggest another mean, if the quantity is a sampled state, whose unit the mean has."""
    bounds = quantity.bounds.rest
    if quantity.name not in prior.names or bounds.lower <= level <= bounds.upper:
        return ""
    ends = ", ".join(ends_shown(bounds.lower, bounds.upper))
    return f"; give a mean inside, or a pair between which it is learned, as mean=({ends})"


def _place_text(quantity: Quantity, level: float, why: str, or_else: str) -> str:
    """Describe where a quantity lies at rest: on one of its bounds, or outside them."""
    bounds = quantity.bounds.rest
    at = f"the {quantity.name} is {bounds.shown(level)}"
    if level in {bounds.lower, bounds.upper}:
        return (
            f"{at}, on a bound of {bounds}: a reference that fades to it has in the end no margin, and rounding alone "
            f"needs one; widen this bound or move the mean inside, if only by a millionth of the width{or_else}"
        )
    return f"{at}, not inside {bounds}: {why}"
