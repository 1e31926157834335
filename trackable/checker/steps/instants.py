"""Instead of boxes, for a claim about sampled instants only: each quantity at k T, one by one."""

from trackable.checker.arithmetic.domains import UndefinedError
from trackable.checker.arithmetic.intervals import Real, at_most, ratio
from trackable.checker.certificate import Certificate, Instants
from trackable.checker.formulas.formula import evaluate
from trackable.checker.formulas.values import Intervals
from trackable.checker.steps.quantities import Look, Quantity


def check_instants(certificate: Certificate, quantities: list[Quantity]) -> str | None:
    """Return the first of the steps 0 … last_step at which a quantity is not shown to lie inside its bounds."""
    claim = certificate.claim
    if not isinstance(claim, Instants):
        return None
    for k in range(claim.last_step + 1):
        for q in quantities:
            looks = {name: _value(certificate, look, k * certificate.step) for name, look in q.looks.items()}
            try:
                value = evaluate(q.formula, looks, Intervals())
            except UndefinedError as undefined:
                return f"instants: the {q.name} is not shown to be defined at step {k}: {undefined}"
            if not (at_most(q.lower, value) and at_most(value, q.upper)):
                return f"instants: the {q.name} is not shown to lie inside its bounds at step {k}"
    return None


def _value(certificate: Certificate, look: Look, t: Real) -> Real:
    """Return the look at a time: offset + Σ w c κ(t + j T − t_i)."""
    value = look.offset
    for signal, weights in zip(certificate.signals, look.weights, strict=True):
        for j, w in enumerate(weights):
            for t_i, c in signal.pairs if w else ():
                value += ratio(w) * c * signal.kernel.value(t + j * certificate.step - t_i)
    return value
