"""The steps of a proof about polynomial pieces, and those of a counterexample."""

from fractions import Fraction

from trackably.checker.certificate import AllPhases, AllTimes, Certificate, Instants
from trackably.checker.counterexample import Counterexample
from trackably.checker.counterexample import Instants as AtStep
from trackably.checker.pieces import why_no_signal
from trackably.checker.steps.pieces.cells import value_at, whole_sum
from trackably.checker.steps.pieces.positivity import is_nowhere_negative
from trackably.checker.steps.pieces.rounding import check_rounding, check_sizes
from trackably.checker.steps.quantities import functionals
from trackably.checker.steps.redundancy import demanded
from trackably.checker.subject import Bound, LinearSystem, Subject
from trackably.checker.watch import progress


def check_signals(subject: Subject) -> str | None:
    """Return which signal is none, or why there can be no proof about pieces; None where all are signals."""
    if not isinstance(subject.system, LinearSystem):
        return "pieces: states and inputs of polynomial pieces are checked for linear systems only"
    return next((reason for z in subject.pieces if (reason := why_no_signal(z))), None)


def check_pieces(certificate: Certificate) -> str | None:
    """Return the first step that fails; None where everything is shown."""
    return (
        _names(certificate)
        or _claimed(certificate)
        or check_sizes(certificate)
        or check_rounding(certificate)
        or _positive(certificate)
    )


def _names(certificate: Certificate) -> str | None:
    bounded = [bound.name for bound in certificate.subject.bounds]
    if not bounded:
        return "names: nothing is bounded"
    if len(set(bounded)) != len(bounded) or sorted(certificate.errors) != sorted(bounded):
        return "names: evaluation errors must have the names of the bounds, each once"
    return None


def _claimed(certificate: Certificate) -> str | None:
    """Return why the claim does not follow from what holds in the cells; None where it does."""
    claim, pieces = certificate.claim, certificate.subject.pieces
    match claim:
        case Instants():
            return "claim: of polynomial pieces, instants are not claimed alone"
        case AllTimes(tail_start):
            if not all(z.beyond == "rest" and z.breakpoints[-1] <= tail_start for z in pieces):
                return f"claim: a signal is not at rest from {tail_start!r} s on"
        case AllPhases(period):
            if not all(z.beyond == "period" and z.period == Fraction(period) for z in pieces):
                return f"period: a signal does not repeat after {period!r} s"
        case _:
            start, end = claim.span
            if not start < end:
                return f"claim: the window from {start!r} s to {end!r} s is none"
            return why_unknown(certificate.subject, Fraction(start), Fraction(end))
    return None


def why_unknown(subject: Subject, start: Fraction, end: Fraction) -> str | None:
    """Return which signal says nothing at some time on which states and inputs depend; None where all say enough."""
    for s, z in enumerate(subject.pieces):
        shifts = len(functionals(subject, "input")[0].weights[s]), len(functionals(subject, "state")[0].weights[s])
        ahead = (max(shifts) - 1) * Fraction(subject.system.sampling_time)
        if z.beyond == "end" and not (z.ends[0] <= start and end + ahead <= z.ends[-1]):
            return f"claim: signal {s} ends before the last time on which inputs until {float(end)!r} s depend"
    return None


def _positive(certificate: Certificate) -> str | None:
    """Return the first bound that is not shown to be kept in each cell."""
    subject, claim = certificate.subject, certificate.claim
    assert not isinstance(claim, Instants), "refused before"
    start, end = map(Fraction, claim.span)
    for i, bound in enumerate(subject.bounds):
        progress(i, len(subject.bounds))
        error = Fraction(certificate.errors[bound.name])
        low, high = Fraction(bound.lower) + error, Fraction(bound.upper) - error
        q = whole_sum(subject, bound.row, functionals(subject, bound.of), [start, end], [low, high])
        bottom, top = int(low * q.unit), int(high * q.unit)
        for first, *others in q.cells(int(start * (1 << q.bits)), int(end * (1 << q.bits))):
            above, below = [first - bottom, *others], [top - first, *(-c for c in others)]
            if not (is_nowhere_negative(above) and is_nowhere_negative(below)):
                return f"cell: the {bound.name} is not shown to stay inside its bounds"
    return None


def check_violation(counterexample: Counterexample) -> str | None:
    """Return why the counterexample shows nothing; None where it refutes what is claimed."""
    subject, where = counterexample.subject, counterexample.where
    if isinstance(where, AtStep):
        t = where.step * Fraction(subject.system.sampling_time)
    else:
        t = Fraction(where.time)
        if not where.start <= where.time <= where.end:
            return f"at: {where.time!r} s is no time of the claim"
    bound = next((bound for bound in subject.bounds if bound.name == counterexample.name), None)
    if bound is None:
        return f"quantity: no bound is called {counterexample.name}"
    ends = _necessary(subject, bound)
    if ends is None:
        return f"attainable: the rows of the input set do not demand the bound of {bound.name}"
    by, value = Fraction(counterexample.violation), value_at(subject, bound.row, functionals(subject, bound.of), t)
    if value + by <= ends[0] or ends[1] + by <= value:
        return why_unknown(subject, t, t)
    return f"value: the {bound.name} is not outside of its bounds by {counterexample.violation!r}"


def _necessary(subject: Subject, bound: Bound) -> tuple[Fraction, Fraction] | None:
    """Return between which values a row has to stay: of redundant inputs, what the rows of U together demand."""
    if bound.of == "state" or not isinstance(subject.system, LinearSystem):
        return Fraction(bound.lower), Fraction(bound.upper)
    return demanded(subject.system, subject.input_set.rows, bound)
