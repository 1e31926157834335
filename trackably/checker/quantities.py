"""The bounded quantities: weighted sums of formulas in the signals at shifted times t + j T, and their values."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from trackably.checker.flatness import Need, needs
from trackably.checker.formulas import Formula, Name, names, shared_parts
from trackably.checker.intervals import ZERO, Real, exact_dot, exact_sum, ratio, total
from trackably.checker.inverse import solved
from trackably.checker.models import enclose
from trackably.checker.moving import Limit, limits
from trackably.checker.subject import (
    Bound,
    Functional,
    LinearSystem,
    Side,
    Signal,
    Subject,
    shifted_name,
)
from trackably.checker.watch import tick

ITSELF = "(itself)"  # the argument of a quantity that is a linear combination itself; no state has this name


@dataclass(frozen=True)
class LinearCombination:
    """A linear combination of shifted signals: offset + Σ_s Σ_j w_sj (z_s(t + j T) − m_s).

    `weights[s][j]` is w_sj, and `offset` is the value if every z_s is its mean m_s. `gross[s]` and `gross_offset` are
    the sums of the absolute values of the weights of z_s, and of the constants, before any terms cancel.
    """

    weights: list[list[Fraction]]
    offset: Real
    gross: list[Fraction]
    gross_offset: Fraction


Shifted = tuple[int, int]
"""s and j of the shifted signal z_s(t + j T)."""


def shifts_of(row: Functional | LinearCombination) -> list[Shifted]:
    """Return the pairs (s, j) of the shifted signals that have a weight other than zero in a row."""
    return [(s, j) for s, weights in enumerate(row.weights) for j, w in enumerate(weights) if w]


def terms_of(argument: LinearCombination) -> Iterator[tuple[Shifted, Real]]:
    """Yield the shifted signals of a linear combination, with their weights."""
    for s, j in shifts_of(argument):
        tick()
        yield (s, j), ratio(argument.weights[s][j])


@dataclass(frozen=True)
class Quantity:
    """A weighted sum of formulas, and the bounds between which it has to stay.

    `parts` are pairs of a weight and a formula. `arguments` are linear combinations of the signals, by the names that
    stand for them in formulas. A quantity that is such a combination itself has the name `ITSELF` as its only part.
    `lower` and `upper` are the ends of the bound, tightened by the evaluation error. For a flat form, the last quantity
    also has `needs`, conditions under which all formulas are defined, and its arguments include those of the needs.
    """

    name: str
    parts: Sequence[tuple[Fraction, Formula]]
    arguments: Mapping[str, LinearCombination]
    lower: Limit
    upper: Limit
    needs: tuple[Need, ...] = ()

    @property
    def combination(self) -> LinearCombination | None:
        """The quantity itself if it is a linear combination of signals; None for other formulas."""
        return self.arguments.get(ITSELF)


def quantities(subject: Subject, errors: Mapping[str, float]) -> list[Quantity]:
    """Return all bounded quantities, with their bounds tightened by the `errors`, which are given by bounds' names.

    Raise UnsolvableError if a nonlinear system x⁺ = f(x, u) without a flat form cannot be solved for u.
    """
    system = subject.system
    if isinstance(system, LinearSystem):
        return [_of_signals(subject, b, b.row, functionals(subject, b.of), errors[b.name]) for b in subject.bounds]
    flat, needed = system.flat or solved(system), needs(system, system.flat) if system.flat else []
    own, n = (*flat.states, *flat.inputs), flat.last_shift + 2
    shared = shared_parts([*own, *(need.formula for need in needed)])
    needed = [replace(need, formula=formula) for need, formula in zip(needed, shared[len(own) :], strict=True)]
    formulas = dict(zip((*system.states, *system.inputs), shared[: len(own)], strict=True))
    signals = range(len(subject.signals))
    shifted = {shifted_name(s, j): shifted_signal(subject, s, j, n) for s in signals for j in range(n)}
    known = {name: _combine(subject, (Fraction(1),), (part,)) for name, part in shifted.items()}

    def arguments_of(every: Iterable[Formula]) -> dict[str, LinearCombination]:
        held = {name for formula in every for name in names(formula)}
        return {name: argument for name, argument in known.items() if name in held}

    found: list[Quantity] = []
    for bound in subject.bounds:
        used = [(r, formulas[name]) for r, name in zip(bound.row, bound.names, strict=True) if r]
        single = [(r, shifted[formula.name]) for r, formula in used if isinstance(formula, Name)]
        if len(single) == len(used):
            row, parts = zip(*single, strict=True)
            found.append(_of_signals(subject, bound, row, parts, errors[bound.name]))
        else:
            arguments = arguments_of(formula for _, formula in used)
            found.append(Quantity(bound.name, used, arguments, *limits(bound, errors[bound.name])))
    if found and needed:
        more = arguments_of(need.formula for need in needed)
        found[-1] = replace(found[-1], needs=tuple(needed), arguments={**more, **found[-1].arguments})
    return found


def _of_signals(
    subject: Subject, bound: Bound, row: tuple[Fraction, ...], parts: tuple[Functional, ...], error: float
) -> Quantity:
    itself = [(Fraction(1), Name(ITSELF))]
    return Quantity(bound.name, itself, {ITSELF: _combine(subject, row, parts)}, *limits(bound, error))


def states_of(subject: Subject) -> list[LinearCombination]:
    """Return linear combinations of signals: the states of a linear system, or the signals of a nonlinear one."""
    return [_combine(subject, (Fraction(1),), (part,)) for part in functionals(subject, "state")]


def functionals(subject: Subject, of: Side) -> tuple[Functional, ...]:
    """Return the states or inputs of a linear system, or the signals of a nonlinear one, as sums of shifted signals."""
    trajectories = subject.trajectories
    if trajectories is not None:
        return trajectories.states if of == "state" else trajectories.inputs
    return tuple(shifted_signal(subject, i, 0, 1) for i in range(len(subject.signals)))


def shifted_signal(subject: Subject, i: int, j: int, count: int) -> Functional:
    """Return z_i(t + j T) as a functional with weights for `count` shifts of each signal."""
    every = range(subject.signal_count)
    return Functional(Fraction(0), tuple(tuple(Fraction((s, k) == (i, j)) for k in range(count)) for s in every))


def _combine(subject: Subject, row: tuple[Fraction, ...], parts: tuple[Functional, ...]) -> LinearCombination:
    """Return Σ_i row_i part_i as a linear combination of the signals without their means."""
    found = weighted_sum(row, parts)
    means = (Fraction(z.mean) for z in subject.signals)
    at_rest = found.offset + exact_dot(means, map(exact_sum, found.weights))
    return LinearCombination([*map(list, found.weights)], ratio(at_rest), *gross_of(row, parts))


def weighted_sum(row: Sequence[Fraction], parts: Sequence[Functional]) -> Functional:
    """Return Σ_i row_i part_i as one functional, a weighted sum of shifted signals."""
    used = [(r, part) for r, part in zip(row, parts, strict=True) if r] or [(Fraction(0), parts[0])]

    def total(values: Sequence[Fraction]) -> Fraction:
        return exact_sum([r * v for (r, _), v in zip(used, values, strict=True) if v])

    by_signal = zip(*(part.weights for _, part in used), strict=True)
    weights = tuple(tuple([total(values) for values in zip(*of, strict=True)]) for of in by_signal)
    return Functional(total([part.offset for _, part in used]), weights)


def gross_of(row: Sequence[Fraction], parts: Sequence[Functional]) -> tuple[list[Fraction], Fraction]:
    """Return the sums of absolute weights of each signal, and of absolute offsets, in Σ_i row_i part_i.

    They are sums of |row_i| times absolute values in part_i, before any terms cancel.
    """
    sizes = [Functional(abs(part.offset), tuple(tuple(map(abs, w)) for w in part.weights)) for part in parts]
    found = weighted_sum([*map(abs, row)], sizes)
    return [*map(exact_sum, found.weights)], found.offset


def value_at(subject: Subject, q: Quantity, t: Real) -> Real:
    """Return an interval that contains q(t). Raise UndefinedError if q may be undefined there."""
    known = dict[Shifted, Real]()
    return value_of(q, {name: combination_at(subject, argument, t, known) for name, argument in q.arguments.items()})


def value_of(q: Quantity, arguments: Mapping[str, Real]) -> Real:
    """Return an interval that contains q for all values of `arguments`. Raise UndefinedError if it may be undefined."""
    return total(ratio(r) * enclose(part, arguments) for r, part in q.parts)


def combination_at(subject: Subject, argument: LinearCombination, t: Real, known: dict[Shifted, Real]) -> Real:
    """Return an interval that contains the linear combination at time t: offset + Σ w c κ(t + j T − t_i).

    Values of z_s(t + j T) − m_s in `known`, by (s, j), are not computed again; computed ones are added to it.
    """
    value = argument.offset
    for (s, j), w in terms_of(argument):
        if (s, j) not in known:
            known[s, j] = _at(subject.signals[s], t + j * subject.step)
        value += w * known[s, j]
    return value


def _at(signal: Signal, t: Real) -> Real:
    """Return an interval that contains z(t) − m, where m is the mean of the signal z."""
    value = ZERO
    for t_i, c in signal.pairs:  # far ones too, as six digits of the sum may be far below its terms
        tick()
        value += c * signal.kernel.value(t - t_i)
    return value
