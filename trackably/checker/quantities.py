"""The bounded quantities: formulas of linear combinations of the signals at shifted times."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from trackably.checker.flatness import Need, Shapes, needs
from trackably.checker.formulas import Formula, Name, Number, Operation, names
from trackably.checker.intervals import Real, exact_sum, ratio
from trackably.checker.inverse import inputs_of
from trackably.checker.moving import Limit, limits
from trackably.checker.subject import (
    Bound,
    FlatForm,
    Functional,
    NonlinearSystem,
    Side,
    Subject,
    as_float,
    indices,
    shifted_name,
)

ITSELF = "itself"


@dataclass(frozen=True)
class LinearCombination:
    """A linear combination of shifted signals: offset + Σ_s Σ_j w_sj (z_s(t + j T) − m_s).

    `weights[s][j]` is w_sj, and `offset` is the value at rest. `gross[s]` and `gross_offset` are the sums of the
    absolute values of w_s and of the constants, of which they consist before any terms cancel.
    """

    weights: list[list[Fraction]]
    offset: Real
    gross: list[Fraction]
    gross_offset: Fraction


@dataclass(frozen=True)
class Quantity:
    """A formula of `arguments`, which are linear combinations of the signals, by name.

    If the row bounds inputs given by formulas, `parts` holds these formulas with their weights; otherwise it is empty.
    `lower` and `upper` are the bound, drawn in by its evaluation error. Of a flat form, the last quantity `needs` what
    keeps all formulas defined; it has all arguments of these too.
    """

    name: str
    formula: Formula
    arguments: Mapping[str, LinearCombination]
    parts: list[tuple[Fraction, Formula]]
    lower: Limit
    upper: Limit
    needs: tuple[Need, ...] = ()
    is_flat: bool = False

    @property
    def combination(self) -> LinearCombination | None:
        """The quantity itself if it is a linear combination of signals; None for other formulas."""
        return self.arguments[ITSELF] if not self.parts else None


def quantities(subject: Subject, errors: Mapping[str, float]) -> list[Quantity]:
    """Return all bounded quantities, with their bounds drawn in by these errors.

    Raise UnsolvableError where f cannot be solved for the inputs.
    """
    system, solved = subject.system, dict[str, Formula]()
    if isinstance(system, NonlinearSystem) and system.flat is not None:
        return _of_flat_form(subject, system, system.flat, errors)
    if isinstance(system, NonlinearSystem):
        solved = inputs_of(system.f, system.successors, system.inputs)
    known = _states_and_successors(subject) if solved else {}
    return [
        _of_formulas(subject, bound, errors[bound.name], solved, known)
        if solved and bound.of == "input"
        else _of_signals(subject, bound, errors[bound.name])
        for bound in subject.bounds
    ]


def _of_signals(subject: Subject, bound: Bound, error: float) -> Quantity:
    argument = _combined(subject, bound.row, functionals(subject, bound.of))
    return Quantity(bound.name, Name(ITSELF), {ITSELF: argument}, [], *limits(bound, error))


def _of_flat_form(
    subject: Subject, system: NonlinearSystem, flat: FlatForm, errors: Mapping[str, float]
) -> list[Quantity]:

    known = {
        shifted_name(s, j): _combined(subject, (Fraction(1),), (_shifted(subject, flat, s, j),))
        for s in range(len(subject.signals))
        for j in range(flat.last_shift + 2)
    }
    needed = needs(system, flat)
    own = (*flat.states, *flat.inputs)
    shared = Shapes().shared([*own, *(need.formula for need in needed)])
    needed = [replace(need, formula=formula) for need, formula in zip(needed, shared[len(own) :], strict=True)]
    formulas = dict(zip((*system.states, *system.inputs), shared[: len(own)], strict=True))
    found: list[Quantity] = []
    for bound in subject.bounds:
        names_of = system.states if bound.of == "state" else system.inputs
        used = [(r, formulas[name]) for r, name in zip(bound.row, names_of, strict=True) if r]
        single = [(r, indices(formula.name)) for r, formula in used if isinstance(formula, Name)]
        if len(single) == len(used):
            row, shifts = tuple(r for r, _ in single), tuple(_shifted(subject, flat, *at) for _, at in single)
            argument = _combined(subject, row, shifts)
            found.append(Quantity(bound.name, Name(ITSELF), {ITSELF: argument}, [], *limits(bound, errors[bound.name])))
        else:
            made = _of_formulas(subject, bound, errors[bound.name], formulas, known)
            found.append(replace(made, is_flat=True))
    held = {name for need in needed for name in names(need.formula)}
    more = {name: argument for name, argument in known.items() if name in held}
    return (
        [*found[:-1], replace(found[-1], needs=tuple(needed), arguments={**more, **found[-1].arguments})]
        if found
        else []
    )


def _shifted(subject: Subject, flat: FlatForm, s: int, j: int) -> Functional:
    return _signal(subject, s, tuple(int(i == j) for i in range(flat.last_shift + 2)))


def _of_formulas(
    subject: Subject,
    bound: Bound,
    error: float,
    solved: Mapping[str, Formula],
    known: Mapping[str, LinearCombination],
) -> Quantity:
    of = subject.system.inputs if bound.of == "input" else subject.system.states
    parts = [(r, solved[v]) for r, v in zip(bound.row, of, strict=True) if r]
    terms = [part if r == 1 else Operation("*", Number(as_float(r)), part) for r, part in parts]
    formula = terms[0]
    for term in terms[1:]:
        formula = Operation("+", formula, term)
    contained = names(formula)
    arguments = {name: argument for name, argument in known.items() if name in contained}
    return Quantity(bound.name, formula, arguments, parts, *limits(bound, error))


def states_of(subject: Subject) -> list[LinearCombination]:
    """Return the states of a linear system, or else the signals, as linear combinations of the signals."""
    return [_combined(subject, (Fraction(1),), (part,)) for part in functionals(subject, "state")]


def functionals(subject: Subject, of: Side) -> tuple[Functional, ...]:
    """Return the states or inputs of a linear system, or the signals of a nonlinear one."""
    trajectories = subject.trajectories
    if trajectories is not None:
        return trajectories.states if of == "state" else trajectories.inputs
    return tuple(_signal(subject, i, (1,)) for i in range(len(subject.signals)))


def _signal(subject: Subject, i: int, weights: tuple[int, ...]) -> Functional:
    every = range(len(subject.signals))
    return Functional(Fraction(0), tuple(tuple(Fraction(w if s == i else 0) for w in weights) for s in every))


def _states_and_successors(subject: Subject) -> dict[str, LinearCombination]:
    arguments = {}
    for i, state in enumerate(subject.system.states):
        arguments[state] = _combined(subject, (Fraction(1),), (_signal(subject, i, (1,)),))
        arguments[f"{state}⁺"] = _combined(subject, (Fraction(1),), (_signal(subject, i, (0, 1)),))
    return arguments


def _combined(subject: Subject, row: tuple[Fraction, ...], parts: tuple[Functional, ...]) -> LinearCombination:
    """Return Σ_i row_i part_i."""
    found, gross = weighted_sum(row, parts), absolute_sum(row, parts)
    of_means = (
        Fraction(z.mean) * exact_sum(weights) for z, weights in zip(subject.signals, found.weights, strict=True)
    )
    at_rest = found.offset + exact_sum(of_means)
    return LinearCombination(
        [*map(list, found.weights)], ratio(at_rest), [*map(exact_sum, gross.weights)], gross.offset
    )


def weighted_sum(row: Sequence[Fraction], parts: Sequence[Functional]) -> Functional:
    """Return Σ_i row_i part_i."""
    used = [(r, part) for r, part in zip(row, parts, strict=True) if r] or [(Fraction(0), parts[0])]
    if len(used) == 1 and used[0][0] == 1:
        return used[0][1]

    def total(values: Sequence[Fraction]) -> Fraction:
        return exact_sum([r * v for (r, _), v in zip(used, values, strict=True) if v])

    by_signal = zip(*(part.weights for _, part in used), strict=True)
    weights = tuple(tuple([total(values) for values in zip(*of, strict=True)]) for of in by_signal)
    return Functional(total([part.offset for _, part in used]), weights)


def absolute_sum(row: Sequence[Fraction], parts: Sequence[Functional]) -> Functional:
    """Return Σ_i |row_i| |part_i|, with the absolute values of all weights and offsets: as if nothing cancelled."""
    used = [(abs(r), part) for r, part in zip(row, parts, strict=True) if r]
    sizes = [
        Functional(abs(part.offset), tuple(tuple([abs(w) if w else w for w in of]) for of in part.weights))
        for _, part in used
    ]
    return weighted_sum([r for r, _ in used], sizes)
