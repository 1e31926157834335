"""The true signal, an extension: how far a reference is from every signal that explains the samples.

Class. A certificate of a linear system may list samples y_i of a state at t_i, samples v_j of the state's rate at s_j,
and numbers ē, ē′, L, M. L or M may be left out, and so may the rates with ē′. This class holds all functions f with
|f(t_i) − y_i| ≤ ē for all i, |f′(s_j) − v_j| ≤ ē′ for all j, |f(s) − f(t)| ≤ L |s − t| and |f′(s) − f′(t)| ≤ M |s − t|
for all s and t.

Theorem. Let x_r(t) be this state in the x(t) of the certificate. If `check` answers Proved, then |x_r(t) − f(t)| ≤ ε_k
for each f of the class and each real t of the cell k, from ends_k to ends_(k+1). If `check` answers Contradicted for
the contradiction of a class, then the class is empty. It stays empty if only ē, or only M (or L, if the contradiction
uses L), grows by less than the answer says.

Proof. At a time τ, let Σ μ_i = 1 and Σ μ_i t_i + Σ ν_j = τ. Then f(τ) − Σ μ_i f(t_i) − Σ ν_j f′(s_j) = ∫ κ f″ with
κ(s) = max(τ − s, 0) − Σ μ_i max(t_i − s, 0) − Σ_(s_j > s) ν_j, by Taylor's formula with integral remainder, as straight
lines give zero. So f(τ) is at most Σ μ_i y_i + Σ ν_j v_j + Σ |μ_i| ē + Σ |ν_j| ē′ + M ∫ |κ|, and at least the same with
minus signs before ē, ē′ and M. In a cell, the upper and the lower side each name two measurements i, j, which bound f
at the times t of the cell
  - by L: f is at most y_i + ē + L |t − t_i|, where j = i;
  - by μ_i = (t_j − t)/(t_j − t_i) and μ_j = 1 − μ_i, where j is another sample: ∫ |κ| is |t − t_i| |t − t_j| / 2;
  - by μ_i = 1 and ν_j = t − t_i, where j is a rate: ∫ |κ| is |∫ |τ − s_j| dτ|, τ from t_i to t.
No time of a named measurement is inside the cell. So t − t_i, t − t_j and t − s_j keep their signs, and each side is a
quadratic polynomial in the cell, which is found from its values at three times, in rational arithmetic. x_r is enclosed
by a Taylor model, as in step 2 of `checker`. The upper side minus x_r, and x_r minus the lower side, are shown to be at
most ε_k.

For a contradiction, let Σ μ_i = 0 and Σ μ_i t_i + Σ ν_j = 0. In the same way, Σ μ_i f(t_i) + Σ ν_j f′(s_j) = ∫ κ f″
with κ(s) = Σ μ_i max(t_i − s, 0) + Σ_(s_j > s) ν_j. So Σ μ_i y_i + Σ ν_j v_j − Σ |μ_i| ē − Σ |ν_j| ē′ ≤ M ∫ |κ| if
f is in the class; the opposite is verified in rational arithmetic. If only Σ μ_i = 0 holds and no ν_j is given, the
left side is at most L ∫ |Σ_(t_i > s) μ_i| ds.

Derived. A certificate may also list times τ with multipliers μ_i of samples and ν_j of rates that bound f(τ) as above.
A side may use the middle of the two bounds as a sample at τ, with half of their distance as its noise.

Plant. If the certificate speaks of disturbances, it may also state a number δ. Then, in the theorem of `disturbances`,
|x(k) − f(t₀ + k T)| ≤ δ for this state and all t₀ + k T in the cells. What is verified is ε_k + h_Z(±r) + h_V(∓r) ≤ δ
for all cells, with the row r that selects the state, and the support functions of Z and V.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Annotated

from trackably.checker.answers import FailedStepError
from trackably.checker.boxes import Box, Enclosures, FirstPass, is_never_negative
from trackably.checker.certificate import Derived, Measured, Pair, Place, SignalClass, TrueSignal
from trackably.checker.disturbances import Robust, keeps_near
from trackably.checker.form import file_of, reader_of
from trackably.checker.intervals import ZERO, Real, exact_sum, exactly, ratio, total
from trackably.checker.limits import CENTRES
from trackably.checker.models import Model
from trackably.checker.quantities import shifts_of, states_of
from trackably.checker.subject import LinearSystem, Subject
from trackably.checker.watch import progress, short, tick

CONTRADICTION, VERSION = "trackably contradicted samples", 1
_DEGREE = 3  # degree of the compared polynomials; higher terms of a model, small in small cells, count as its error


@dataclass(frozen=True)
class ContradictedSamples:
    """A class that holds no signal, and the proof: multipliers μ_i of all its samples and ν_j of all its rates."""

    of: SignalClass
    samples: Annotated[tuple[Fraction, ...], CENTRES]
    rates: Annotated[tuple[Fraction, ...], CENTRES] = ()


read_contradicted = file_of("contradiction of samples", VERSION, reader_of(ContradictedSamples))


def check_truth(subject: Subject, truths: Sequence[TrueSignal], robust: Robust | None, first_pass: FirstPass) -> None:
    """Raise FailedStepError at the first stated distance of a state from its true signals that is not shown."""
    for truth in truths:
        _check_fit(subject, truth, robust)
        for k, sides in enumerate(gaps(subject, truth, first_pass)):
            progress(k, len(truth.errors))
            error = exactly(truth.errors[k])
            cell = f"from {truth.ends[k]!r} s to {truth.ends[k + 1]!r} s"
            for side in sides:
                if side is None:
                    raise FailedStepError(
                        f"truth: measurements named in `upper` or `lower` give no bound of the signal {cell}"
                    )
                if not is_never_negative(Model.constant(error, len(side.coefficients)) - side):
                    raise FailedStepError(
                        f'truth: "{truth.state}" may be further than {truth.errors[k]!r} from the true signal {cell}'
                    )


def _check_fit(subject: Subject, truth: TrueSignal, robust: Robust | None) -> None:
    system, count = subject.system, len(truth.errors)
    if subject.pieces or not isinstance(system, LinearSystem) or truth.state not in system.states:
        raise FailedStepError(
            "truth: it must be about a state of a linear system, with signals that are sums of kernels"
        )
    if not len(truth.ends) - 1 == len(truth.radii) == len(truth.upper) == len(truth.lower) == count:
        raise FailedStepError(
            "truth: `radii`, `upper`, `lower` and `errors` must have one entry for each cell, and `ends` one more"
        )
    if any(not start < end for start, end in pairwise(truth.ends)):
        raise FailedStepError(
            "truth: the `ends` of cells must increase, but two successive ones are "
            f"{min(pairwise(truth.ends), key=lambda cell: cell[1] - cell[0])} s"
        )
    if not _is_ordered(truth.of):
        raise FailedStepError(f"truth: {_UNORDERED}")
    if truth.plant is not None:
        room = Fraction(truth.plant) - Fraction(truth.error)
        if robust is None or not keeps_near(system, robust, system.states.index(truth.state), room):
            raise FailedStepError(
                f"truth: under disturbance the plant may be further than {truth.plant!r} (`plant`) from the true signal"
            )


_UNORDERED = "measurements must have increasing times, and a value for each time"


def _is_ordered(of: SignalClass) -> bool:
    every = [measured for measured in (of.samples, of.rates) if measured]
    return all(len(at.times) == len(at.values) and all(a < b for a, b in pairwise(at.times)) for at in every)


def gaps(subject: Subject, truth: TrueSignal, first_pass: FirstPass) -> Iterator[tuple[Model | None, Model | None]]:
    """Yield, for each cell, Taylor models of the upper side minus the state, and of the state minus the lower side.

    A cell is an interval of time, and a side a bound of all signals of the class there. None takes the place of the
    model of an invalid side.
    """
    state, every = states_of(subject)[subject.system.states.index(truth.state)], places(truth)
    boxes = [Box(*ends, radius) for ends, radius in zip(pairwise(truth.ends), truth.radii, strict=True)]
    models = first_pass.models(subject, shifts_of(state), boxes, truth.terms)
    for box, known, above, below in zip(boxes, models, truth.upper, truth.lower, strict=True):
        model = Enclosures(subject, truth.terms, box, known).combination(state)
        kept, cut = model.coefficients[: _DEGREE + 1], model.coefficients[_DEGREE + 1 :]
        kept = [*kept, *[ZERO] * (_DEGREE + 1 - len(kept))]
        missed = model.missed + total(abs(c) for c in cut)
        upper, lower = side(truth.of, above, 1, box, every), side(truth.of, below, -1, box, every)
        yield _over(upper, 1, kept, missed), _over(lower, -1, kept, missed)


def _over(side: list[Fraction] | None, sign: int, kept: list[Real], missed: Real) -> Model | None:
    """Return a Taylor model of sign · (side − reference), where `side` has the coefficients of a bound of the signals.

    The model of the reference has the coefficients `kept` and the remainder `missed`. Return None without a side.
    """
    if side is None:
        return None
    return Model([sign * (ratio(s) - c) for s, c in zip([*side, Fraction(0)], kept, strict=True)], missed)


def places(truth: TrueSignal) -> dict[int, Place]:
    """Return time, value and noise of each sample and each `derived` point, by their numbers."""
    found = dict(enumerate(truth.of.samples.places))
    first = len(found) + (len(truth.of.rates.times) if truth.of.rates else 0)
    for k, derived in enumerate(truth.derived):
        ends = [extreme(truth.of, derived, sign) for sign in (1, -1)]
        if ends[0] is not None and ends[1] is not None:
            found[first + k] = Fraction(derived.time), (ends[0] + ends[1]) / 2, (ends[0] - ends[1]) / 2
    return found


def _measured(by: Measured | None, k: int) -> Place | None:
    """Return time, value and largest error of measurement k, counted from 0; None if there is none."""
    return by.places[k] if by and 0 <= k < len(by.places) else None


_Weighted = list[tuple[Fraction, Place]]
"""Pairs of a multiplier, μ or ν, and a measurement."""
_Powers = list[tuple[Fraction, Fraction]]
"""Pairs of a multiplier and a time [s]: of max(t − s, 0), or of its derivative in t, which is 1 for s < t."""


def extreme(of: SignalClass, derived: Derived, sign: int) -> Fraction | None:
    """Return the upper bound of all signals of a class at a `derived` time; the lower one for `sign` −1.

    Return None if the multipliers show no bound.
    """
    n, points, rates = len(of.samples.times), _Weighted(), _Weighted()
    for i, m in derived.upper if sign > 0 else derived.lower:
        if (place := _measured(of.samples, i) or _measured(of.rates, i - n)) is None:
            return None
        (points if i < n else rates).append((m, place))
    return _bound(of, Fraction(derived.time), points, rates, sign)


def _bound(of: SignalClass, t: Fraction, points: _Weighted, rates: _Weighted, sign: int) -> Fraction | None:
    """Return the bound Σ μ y + Σ ν v ± (Σ |μ| ē + Σ |ν| ē′ + M ∫ |κ|) of f(t), as in the module's proof.

    `points` and `rates` are pairs of a multiplier, μ or ν, and a measurement. Return None if multipliers do not fit t.
    """
    M, here, jumps = of.second_derivative, [(Fraction(-1), t), *_powers(points)], _powers(rates)
    if M is None or any(_of_line(here, jumps)):
        return None
    seen, noise = _seen([*points, *rates])
    return seen + sign * (noise + Fraction(M) * _integral(here, jumps))


def _powers(weighted: _Weighted) -> _Powers:
    return [(m, t) for m, (t, _, _) in weighted]


def _of_line(points: _Powers, jumps: _Powers) -> tuple[Fraction, Fraction]:
    """Return Σ μ and Σ μ t + Σ ν: the weighted sums of measurements of the straight lines f(t) = 1 and f(t) = t."""
    return exact_sum(m for m, _ in points), exact_sum([*(m * t for m, t in points), *(m for m, _ in jumps)])


def _seen(used: _Weighted) -> tuple[Fraction, Fraction]:
    """Return Σ m y, the sum of multipliers times values, and its largest error, Σ |m| ē."""
    return exact_sum(m * y for m, (_, y, _) in used), exact_sum(abs(m) * noise for m, (_, _, noise) in used)


def side(of: SignalClass, pair: Pair, sign: int, box: Box, every: Mapping[int, Place]) -> list[Fraction] | None:
    """Return the coefficients in x ∈ [−1, 1] of an upper bound of all signals of a class in a box; lower for `sign` −1.

    `pair` has the numbers of two measurements, and `every` has all points at which signals are known (`places`). Return
    None if the pair gives no bound for this class, or if the time of a measurement is inside of the box.
    """
    tick()
    (i, j), n = pair, len(of.samples.times)
    start, end = Fraction(box.start), Fraction(box.end)
    first, second = every.get(i), every.get(j) or _measured(of.rates, j - n)
    if first is None or second is None or any(start < t < end for t, _, _ in (first, second)):
        return None
    (t_i, y_i, noise_i), (t_j, _, _) = first, second

    def at(t: Fraction) -> Fraction | None:
        since = t - t_i
        if i == j:
            return None if of.slope is None else y_i + sign * (noise_i + Fraction(of.slope) * abs(since))
        if j not in every:
            return _bound(of, t, [(Fraction(1), first)], [(since, second)], sign)
        share = since / (t_j - t_i) if t_i != t_j else Fraction(0)
        return _bound(of, t, [(1 - share, first), (share, second)], [], sign)

    low, middle, high = map(at, (start, (start + end) / 2, end))
    if low is None or middle is None or high is None:
        return None
    return [middle, (high - low) / 2, (high + low) / 2 - middle]  # the side is quadratic in the box


def contradiction_of(found: ContradictedSamples) -> tuple[Fraction, Fraction, Fraction, str]:
    """Return by how much samples contradict the class of signals, with the sensitivities to its bounds.

    With the symbols of the module, the sensitivities are Σ |μ_i| (to the noise; 0 if there are multipliers ν_j) and
    ∫ |κ| (to the bound of slope or second derivative). The name of this bound comes last. Raise FailedStepError if the
    samples are not shown to contradict the class.
    """
    of, sides = found.of, ((found.samples, found.of.samples), (found.rates, found.of.rates or Measured((), (), 0.0)))
    if any(len(by) != len(at.times) for by, at in sides):
        raise FailedStepError("there must be one multiplier for each measurement, sample or rate")
    if not _is_ordered(of):
        raise FailedStepError(_UNORDERED)
    used, of_rates = ([(m, place) for m, place in zip(by, at.places, strict=True) if m] for by, at in sides)
    points, jumps = _powers(used), _powers(of_rates)
    constant, line = _of_line(points, jumps)
    if constant or not points:
        raise FailedStepError("multipliers of samples must have the sum 0, and not all be 0")
    if of.second_derivative is not None and not line:
        bound, size, name = of.second_derivative, _integral(points, jumps), "second derivative"
    elif of.slope is not None and not jumps:
        bound, size, name = of.slope, _integral([], points), "slope"
    else:
        raise FailedStepError(
            "multipliers must give a straight line (a constant, if only the slope is bounded) the weighted sum 0"
        )
    seen, noise = _seen([*used, *of_rates])
    excess = seen - noise - Fraction(bound) * size
    if excess <= 0 or not size:
        raise FailedStepError(
            "the samples are not shown to contradict the class of signals: its bounds allow their weighted sum"
        )
    return excess, Fraction(0) if jumps else exact_sum(abs(m) for m, _ in points), size, name


def _integral(points: _Powers, jumps: _Powers) -> Fraction:
    """Return the integral over s of |Σ_i μ_i max(t_i − s, 0) + Σ_(s_j > s) ν_j|, exactly.

    It begins at the first of the times t_i and s_j. `points` are the pairs (μ_i, t_i), `jumps` the pairs (ν_j, s_j).
    """
    found = Fraction(0)
    for a, b in pairwise(sorted({t for _, t in (*points, *jumps)})):
        step = exact_sum(m for m, t in jumps if t >= b)
        left, right = (step + exact_sum(m * (t - s) for m, t in points if t >= b) for s in (a, b))
        both = abs(left) + abs(right)
        found = short(found + (b - a) / 2 * (both if left * right >= 0 else (left**2 + right**2) / both))
    return found
