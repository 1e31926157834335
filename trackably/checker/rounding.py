"""Step 5 of the proof: the rounding errors of float64 evaluation are at most the stated errors.

Assumed of formulas: + − · / are rounded once; functions and powers are off by 4 units in the last place at most, 8
roundings. Before, all numbers are shown to have sizes for which this analysis holds.

Of a flat form, rounding errors depend on where the signals are, and are bounded there: in each box, at each instant and
in the tail, with what its formulas need to have values.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache

from trackably.checker.certificate import Certificate
from trackably.checker.formulas import Formula, evaluate, numbers, text
from trackably.checker.intervals import (
    SIGN,
    UNIT,
    ZERO,
    Real,
    UndefinedError,
    at_most,
    between,
    change_of_angle,
    either,
    exact_sum,
    exactly,
    lesser,
    ratio,
    require,
    require_nonzero,
    require_positive,
    side,
    slope_of_function,
    slope_of_power,
    total,
)
from trackably.checker.kernels import Decay
from trackably.checker.models import Model, Models
from trackably.checker.quantities import ITSELF, LinearCombination, Quantity, functionals
from trackably.checker.subject import NonlinearSystem, Signal, Subject, single_bounds
from trackably.checker.watch import tick

_HALVINGS = 12  # of the span of the centres, from which they are sorted by their distance
_UNDERFLOW = exactly(2) ** -1000
_OVERFLOW = exactly(10) ** 300


@dataclass(frozen=True)
class Tracked:
    """Real numbers in a `model`, and their float64 values, which differ from them by at most `error`."""

    model: Model
    error: Real

    @property
    def computed(self) -> Real:
        """An interval that contains the float64 values and the real numbers."""
        return self.model.span + SIGN * self.error

    def __add__(self, other: "Tracked") -> "Tracked":
        return _track(self.model + other.model, self.error + other.error)

    def __sub__(self, other: "Tracked") -> "Tracked":
        return _track(self.model - other.model, self.error + other.error)

    def __mul__(self, other: "Tracked") -> "Tracked":
        propagated = self.error * abs(other.computed) + abs(self.model.span) * other.error
        return _track(self.model * other.model, propagated)


@dataclass(frozen=True)
class TrackedFormulas:
    """The arithmetic of formulas on tracked models with this number of `terms`."""

    terms: int

    @property
    def _models(self) -> Models:
        return Models(self.terms)

    def constant(self, value: float) -> Tracked:
        return Tracked(self._models.constant(value), ZERO)

    def over(self, a: Tracked, b: Tracked) -> Tracked:
        require_nonzero(b.computed)
        found = self._models.over(a.model, b.model)
        return _track(found, (a.error + abs(found.span) * b.error) / abs(b.computed))

    def power(self, a: Tracked, exponent: float) -> Tracked:
        slope = slope_of_power(a.computed, exponent)
        return _track(self._models.power(a.model, exponent), abs(slope) * a.error, 8)

    def function(self, name: str, a: Tracked) -> Tracked:
        require_positive(name, a.computed)
        slope = slope_of_function(name, a.computed)
        return _track(self._models.function(name, a.model), abs(slope) * a.error, 8)

    def angle(self, y: Tracked, x: Tracked) -> Tracked:
        side(y.computed, x.computed)
        changed = change_of_angle(y.computed, x.computed, y.error, x.error)
        return _track(self._models.angle(y.model, x.model), changed, 8)


def _track(model: Model, propagated: Real, roundings: int = 1) -> Tracked:
    """Round a value whose operands have errors. Raise UndefinedError if it may overflow."""
    computed = abs(model.span + SIGN * propagated)
    require(computed.b < _OVERFLOW, "it may overflow")
    return Tracked(model, (propagated + roundings * UNIT * computed + _UNDERFLOW).b)


def _interval(values: Real, error: Real) -> Tracked:
    return Tracked(Models(1).number(values), error)


TINY = exactly(2) ** -300


def check_rounding(certificate: Certificate, quantities: list[Quantity]) -> str | None:
    """Return the first quantity whose error may exceed the stated one.

    Errors of signals are bounded to first order in u, enlarged by 1 %. Errors of formulas are propagated from operation
    to operation.
    """
    of_signals = signal_errors(certificate.subject, certificate.until)
    for q in quantities:
        if q.is_flat:  # `FlatValues` does it
            continue
        try:
            error = error_of(certificate.subject, q, of_signals)
        except UndefinedError as undefined:
            return f"evaluation: the error of the {q.name} in float64 is not bounded: {undefined}"
        if not at_most(error, certificate.errors[q.name]):
            return f"evaluation: the {q.name} can be off by more than {certificate.errors[q.name]!r} in float64"
    return None


def signal_errors(subject: Subject, until: float) -> list[Tracked]:
    """Return the rounding errors of the signals at all times |t| ≤ `until` [s], with enclosures of the signals."""
    return [_signal_error(subject, until, signal) for signal in subject.signals]


def error_of(subject: Subject, q: Quantity, of_signals: list[Tracked]) -> Real:
    """Over-estimate the rounding error of a quantity. Raise UndefinedError if it is unbounded."""
    if q.combination is not None:
        return _combination(subject, q.combination, of_signals).error
    values = {name: _combination(subject, argument, of_signals) for name, argument in q.arguments.items()}
    for i, state in enumerate(subject.system.states):
        if state in values:  # bounds of states are proved without any use of this step
            values[state] = _interval(_within(subject, i, values[state].model.span), values[state].error)
    parts = [(ratio(r), evaluate(part, values, TrackedFormulas(1))) for r, part in q.parts]
    return _of_row(parts, len(subject.system.inputs) + 2)


def _of_row(parts: list[tuple[Real, Tracked]], roundings: int) -> Real:
    """Over-estimate the rounding error of a weighted sum."""
    error = total(abs(r) * part.error for r, part in parts)
    size = total(abs(r) * abs(part.computed) for r, part in parts)
    return exactly(1.01) * (error + roundings * UNIT * size) + TINY


def _combination(subject: Subject, argument: LinearCombination, of_signals: list[Tracked]) -> Tracked:
    error = total(ratio(w) * z.error for w, z in zip(argument.gross, of_signals, strict=True))
    size = ratio(argument.gross_offset) + total(
        ratio(w) * abs(z.model.span) for w, z in zip(argument.gross, of_signals, strict=True)
    )
    roundings = 5 + _terms(subject) + max(len(subject.system.states), len(subject.system.inputs))
    tiny = TINY * (1 + ratio(exact_sum(argument.gross)))
    return _interval(SIGN * size, 1.01 * (error + roundings * UNIT * size) + tiny)


def _within(subject: Subject, i: int, exact: Real) -> Real:
    """Return the part of an interval that is inside all bounds of the i-th state alone."""
    low, high = exact.a, exact.b
    for j, *ends in single_bounds(subject.state_set):
        if i == j:
            least, most = map(ratio, ends)
            low, high = least.a if least.a > low else low, most.b if most.b < high else high
    return between(low, high) if low <= high else exact


def _terms(subject: Subject) -> int:
    """Return the number of shifted signals that an input depends on."""
    if isinstance(subject.system, NonlinearSystem):
        return 2 if subject.system.flat is None else 1 + subject.system.flat.last_shift
    return sum(map(len, functionals(subject, "input")[0].weights))


def _ahead(subject: Subject) -> Real:
    """Return the largest shift j T [s] of a signal on which a state or an input depends."""
    if isinstance(subject.system, NonlinearSystem):
        return subject.step if subject.system.flat is None else subject.system.flat.last_shift * subject.step
    parts = (*functionals(subject, "state"), *functionals(subject, "input"))
    return (max(len(w) for part in parts for w in part.weights) - 1) * subject.step


def _signal_error(subject: Subject, until: float, signal: Signal) -> Tracked:
    """Over-estimate |z| and |float64 − exact| for |t| ≤ until, and for the shifts T, 2 T, … beyond."""
    latest, ahead = exactly(max(map(abs, signal.centres))), _ahead(subject)
    kernel = signal.kernel.sizes(until + ahead + latest)
    # Tracked once each, by u times their sizes: k T, j T, k T + j T, and r = k T + j T − t_i. As |k T + j T| is at most
    # |r| + |t_i|, and |k T| at most j T more, r is off by 3 u (|r| + |t_i| + j T) at most. Beside that there are up to
    # six roundings of the argument of κ, and n + 2 of the dot product. A time that was moved by whole periods may be
    # off by u until instead; j T adds u j T, k T + j T adds u (until + j T), and r adds u (until + j T + |t_i|). That
    # is less than 3 u times `farthest`, and where all kernels repeat, `stretch` is `farthest` times `slope`.
    weight, near = total(abs(c) for _, c in signal.pairs), largest_sums(signal)
    of_all = weight * (kernel.roundings + 9 * kernel.stretch)
    of_near = 3 * (latest + ahead) * near.slope + (len(signal.weights) + 3) * near.size
    largest = abs(exactly(signal.mean)) + near.size
    return _interval(SIGN * largest, UNIT * (of_all + of_near + 3 * largest))


@lru_cache(maxsize=8)  # a prover asks more than once about the signals that it hands over
def largest_sums(signal: Signal) -> Decay:
    """Over-estimate Σ_i |c_i| |κ(t − t_i)| for all times t, and the same sum of κ̇.

    Few centres are near t, and kernels at the others are small. Times are cut into cells of equal width. Centres within
    one width of t lie in three neighbouring cells, whatever t is: these weigh no more than the `heaviest` three. For
    them, sizes beyond the width are replaced by larger ones; and so on for half the width. Weights are added in
    float64: n positive numbers have n roundings at most, in any order.
    """
    first = Fraction(min(signal.centres))
    width = (Fraction(max(signal.centres)) - first) / 2**_HALVINGS
    cells = dict[int, float]()
    for t, c in zip(signal.centres, signal.weights, strict=True):
        tick()
        cell = int((Fraction(t) - first) // width) if width else 0
        cells[cell] = cells.get(cell, 0.0) + abs(c)
    widest = dict[float, Fraction]()  # of the widths with the same heaviest cells the largest, which says most
    for _ in range(_HALVINGS):
        tick()
        heaviest = max(own + cells.get(cell + 1, 0.0) + cells.get(cell + 2, 0.0) for cell, own in cells.items())
        widest[heaviest] = width
        wider = dict[int, float]()
        for cell, own in cells.items():
            wider[cell // 2] = wider.get(cell // 2, 0.0) + own
        cells, width = wider, 2 * width
    size, slope = signal.kernel.peak
    of_size = of_slope = ZERO
    for heaviest, far in widest.items():
        beyond = signal.kernel.beyond(ratio(far))
        smaller, flatter = lesser(size, beyond.size), lesser(slope, beyond.slope)
        of_size += heaviest * (size.b - smaller.b)
        of_slope += heaviest * (slope.b - flatter.b)
        size, slope = smaller, flatter
    weight, grown = sum(cells.values()), 1 + 2 * (len(signal.weights) + 2) * UNIT
    return Decay(grown * (of_size + weight * size.b), grown * (of_slope + weight * slope.b))


def check_sizes(certificate: Certificate, quantities: list[Quantity]) -> str | None:
    """Verify that no number is so large, or so small, that float64 evaluation could overflow or lose a factor."""
    values: list[float] = []
    positive: list[float] = [certificate.subject.system.sampling_time]
    for signal in certificate.subject.signals:
        values += [*signal.centres, *signal.weights, signal.mean]
        positive += signal.kernel.numbers
    positive += [
        float(min(max(factor, Fraction(1, 10**40)), Fraction(10**40))) for factor in _factors(certificate, quantities)
    ]
    if max(map(abs, [*values, *positive])) > 1e30 or min(positive) < 1e-30:
        return "sizes: some number is too large or too small for the analysis of rounding"
    if certificate.until > 1e60 or not all(
        at_most(signal.kernel.peak.size, 1e100) for signal in certificate.subject.signals
    ):
        return "sizes: some value could overflow in float64 evaluation"
    return None


def _factors(certificate: Certificate, quantities: list[Quantity]) -> list[Fraction]:
    """Return all factors other than zero that occur in float64 evaluation."""
    arguments = [argument for q in quantities for argument in q.arguments.values()]
    factors = [size for argument in arguments for size in (*argument.gross, argument.gross_offset)]
    factors += [abs(r) for q in quantities for r, _ in q.parts]
    if isinstance(certificate.subject.system, NonlinearSystem):
        factors += [abs(Fraction(v)) for formula in certificate.subject.system.f for v in numbers(formula)]
    return [factor for factor in factors if factor]


_OUTER = 6


@dataclass(frozen=True)
class FlatNeeds:
    """Data for rounding errors of formulas: `stated` errors, those of shifted signals by name,
    and a row's count of roundings.
    """

    stated: Mapping[str, float]
    of_arguments: Mapping[str, Real]
    roundings: int

    @classmethod
    def of(cls, certificate: Certificate, quantities: list[Quantity]) -> "FlatNeeds":
        """Return the data for these quantities; empty if none is of a flat form."""
        subject = certificate.subject
        arguments = {
            name: argument
            for q in quantities
            if q.is_flat or q.needs
            for name, argument in q.arguments.items()
            if name != ITSELF
        }
        of_signals = signal_errors(subject, certificate.until) if arguments else []
        errors = {name: _combination(subject, argument, of_signals).error for name, argument in arguments.items()}
        return cls(certificate.errors, errors, len(subject.system.states) + len(subject.system.inputs) + 2)


@dataclass(frozen=True)
class FlatValues:
    """Values of the formulas of a flat form for given values of the shifted signals; each part is computed once."""

    needs: FlatNeeds
    terms: int
    known: dict[Formula, Tracked] = field(default_factory=dict)

    def enclose(self, q: Quantity, arguments: Mapping[str, Model]) -> Model:
        """Enclose a quantity q. All quantities are evaluated at the same `arguments`, or at none.

        UndefinedError: a formula in q may be undefined, or the rounding error of q may exceed the stated one.
        """
        tracked = self._track(arguments)
        for need in q.needs:
            span = self._of(need.formula, tracked).model.span
            what = "may be zero" if need.may_be_negative else "may not be positive"
            holds = either(span.a > 0, need.may_be_negative and span.b < 0)
            require(holds, f"{text(need.formula, _OUTER)} {what}")
        if not q.is_flat:
            return evaluate(q.formula, arguments, Models(self.terms))
        parts = self._parts(q, tracked)
        stated = self.needs.stated[q.name]
        require(_of_row(parts, self.needs.roundings).b <= stated, f"it can be off by more than {stated!r} in float64")
        found = Models(self.terms).number(ZERO)
        for r, part in parts:
            found += part.model.times(r)
        return found

    def error(self, q: Quantity, arguments: Mapping[str, Model]) -> Real:
        """Over-estimate the rounding error of a formula. Raise UndefinedError where it may not be defined."""
        return _of_row(self._parts(q, self._track(arguments)), self.needs.roundings)

    def _track(self, arguments: Mapping[str, Model]) -> dict[str, Tracked]:
        errors = self.needs.of_arguments
        return {name: Tracked(model, errors[name]) for name, model in arguments.items() if name in errors}

    def _parts(self, q: Quantity, tracked: Mapping[str, Tracked]) -> list[tuple[Real, Tracked]]:
        return [(ratio(r), self._of(part, tracked)) for r, part in q.parts]

    def _of(self, formula: Formula, values: Mapping[str, Tracked]) -> Tracked:
        return evaluate(formula, values, TrackedFormulas(self.terms), self.known)
