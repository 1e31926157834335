"""Flat forms of nonlinear systems: states and inputs as formulas of flat outputs at this step and at later ones."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import comb, pi, tan
from typing import Any, Self

import numpy as np

from trackably.checker import flatness, subject
from trackably.checker.answers import FailedStepError
from trackably.checker.flatness import substitute
from trackably.checker.formulas import (
    Angle,
    Formula,
    Function,
    Name,
    Number,
    Operation,
    Power,
    names,
    operands,
    parts,
    rewritten,
    shared_parts,
)
from trackably.checker.identities import INVERSES
from trackably.checker.inverse import UnsolvableError, inputs_of, plus, times
from trackably.checker.subject import shifted_name
from trackably.systems.formulas import ONE, size_and_depth
from trackably.systems.intervals import Interval
from trackably.systems.tracing import Symbol, formulas_of

MOST_SHIFTS = 12  # largest j of a variable z{c}[j]
MOST_PARTS = 30_000
"""A flat form is found automatically only if each formula has at most this many operations, names and numbers. A part
of a formula that occurs several times counts each time."""


@dataclass(frozen=True, eq=False)
class FlatForm(subject.FlatForm):
    """x(k) = X(z(k), z(k + 1), …) and u(k) = U(z(k), z(k + 1), …), where z_c(k + j) is the variable z{c}[{j}].

    States named in `angles` matter up to whole turns only. Their formulas may jump by 2π, as the angle of a vector
    does. Each formula p in `positive` is assumed positive, so that √(p²) = p; the proof of a reference verifies that it
    is.
    """

    def __post_init__(self) -> None:
        shared = iter(shared_parts((*self.states, *self.inputs, *self.positive)))  # equal subformulas become one object
        for name in ("states", "inputs", "positive"):
            object.__setattr__(self, name, tuple(next(shared) for _ in getattr(self, name)))
        try:
            used = {c for c, _ in self.indices}
        except ValueError as other:
            raise ValueError(f"flat form: expected formulas of flat outputs, as z1[0], got one with {other}") from None
        if missing := {*range(1 + max(used, default=0))} - used:
            raise ValueError(
                f"flat form: expected formulas that use all flat outputs, but no state and no input depends on "
                f"z{min(missing) + 1}; leave this flat output out"
            )

    @classmethod
    def of(cls, function: Callable[[Any], Any], outputs: int, angles: Sequence[str] = ()) -> Self:
        """Return the flat form of a function of z that returns a list of states and a list of inputs.

        z[j] is the array of the flat outputs at step k + j. The function is called with symbols, so it must use
        ordinary arithmetic only (see `tracing.Symbol`). ValueError: the function cannot be called with symbols, or
        returns anything else; the message says why.
        """
        states, inputs = formulas_of(lambda: function(_Shifts(outputs)))
        return cls(states, inputs, tuple(angles))

    @property
    def outputs(self) -> int:
        """The number of flat outputs."""
        return 1 + max(c for c, _ in self.indices)

    @cached_property
    def orders(self) -> tuple[int, ...]:
        """The number of steps that each flat output looks ahead, at least one."""
        return tuple(max(1, *(j for d, j in self.indices if d == c)) for c in range(self.outputs))


@dataclass(frozen=True)
class _Shifts:
    """The argument z of a function of flat outputs: z[j] has the symbols of all flat outputs at step k + j."""

    outputs: int

    def __getitem__(self, j: Any) -> Any:
        if not isinstance(j, int) or not 0 <= j < MOST_SHIFTS:
            raise ValueError(f"z[j]: expected a step j from 0 to {MOST_SHIFTS - 1}, got {j!r}")
        return np.array([Symbol(Name(shifted_name(c, j))) for c in range(self.outputs)], dtype=object)


# Verify a flat form, f(X(z), U(z)) = X(z one step later), as an identity.
#
# The checker judges: it compares both sides by normal forms, so that the identity holds wherever all parts are defined.
# For a state that is an angle, it shows that both sides have the same sine and cosine, and that changes of x by 2π in
# angles change f(x, u) by multiples of 2π in angles only (`checker.flatness` has the theorem and its proof).


def why_not_flat(system: subject.NonlinearSystem, form: FlatForm) -> str | None:
    """Return why `form` is no flat form of a system, or is not shown to be one; None if it is shown to be one."""
    if (len(form.states), len(form.inputs)) != (len(system.states), len(system.inputs)):
        return (
            f"has formulas of {len(form.states)} states and {len(form.inputs)} inputs, but the system has "
            f"{len(system.states)} and {len(system.inputs)}"
        )
    if unknown := {*form.angles} - {*system.states}:
        return f"calls {min(unknown)} an angle, which is no state"
    try:
        flatness.check_flat_form(system, form)
    except FailedStepError as error:
        return (
            f"is not proved to satisfy f, as {str(error).removeprefix('flat: ')}; if it is right on paper, write "
            "z / h / h in place of z / h**2, because rounded numbers satisfy no identity exactly, name headings in "
            "angles=[…], and write turns as differences of headings"
        )
    return None


# Find flat forms of systems whose equations can be solved one after the other, in small blocks.
#
# As many states as there are inputs are taken for flat outputs. If x_i is known and its equation x_i⁺ = f_i = a + b v
# contains one unknown v, then v is (x_i⁺ − a)/b. If no equation has a single unknown, two or three equations that are
# affine in as many unknowns are solved together. Instead of v, they may contain one part v' such as √(c v + d), which
# is then the unknown (`_solve`). If all states and inputs are known in the end, their formulas are a flat form.

_MOST_CHOICES = 2000  # choices of states as flat outputs; if there are more, no flat form is searched
_MOST_COUPLED = 3  # largest number of equations that are solved together


def found_form(f: Sequence[Formula], states: Sequence[str], inputs: Sequence[str]) -> FlatForm:
    """Return the first flat form found whose flat outputs are some of the states.

    Raise UnsolvableError if none is found, with the message of one choice of states.
    """
    if not 0 < len(inputs) < len(states):
        raise UnsolvableError("there must be at least one input, and not more inputs than states")
    if (count := comb(len(states), len(inputs))) > _MOST_CHOICES:
        raise UnsolvableError(f"as many states as inputs can be chosen in {count} ways, more than {_MOST_CHOICES}")
    f, failures = shared_parts(f), list[_StuckError]()
    for choice in combinations(range(len(states)), len(inputs)):
        try:
            return _form_of_choice(f, states, inputs, choice)
        except _StuckError as error:
            failures.append(error)
    raise min(failures, key=lambda error: error.rank)


class _StuckError(UnsolvableError):
    """No more equations can be solved. The search reports the error of the lowest `rank`."""

    def __init__(self, why: str, rank: tuple[bool, int]) -> None:
        super().__init__(why)
        self.rank = rank


def _form_of_choice(
    f: Sequence[Formula], states: Sequence[str], inputs: Sequence[str], choice: tuple[int, ...]
) -> FlatForm:
    known: dict[str, Formula] = {states[i]: Name(shifted_name(c, 0)) for c, i in enumerate(choice)}
    positive: list[Formula] = []
    waiting = dict(zip(states, f, strict=True))
    while waiting:
        solved, found, roots = _solve_block(waiting, known)
        waiting = {state: formula for state, formula in waiting.items() if state not in solved}
        known |= found
        positive += roots
    return FlatForm(
        tuple(known[name] for name in states), tuple(known[name] for name in inputs), positive=tuple(positive)
    )


def _solve_block(
    waiting: Mapping[str, Formula], known: Mapping[str, Formula]
) -> tuple[tuple[str, ...], dict[str, Formula], list[Formula]]:
    """Find a smallest set of equations with exactly as many unknowns, and solve it for the unknowns.

    Return the states x_i whose equations x_i⁺ = f_i these are, the formulas of the unknowns, and those of the roots
    that are assumed positive. Raise _StuckError if there is no set that can be solved.
    """
    ready = [state for state in waiting if state in known and not _is_far_ahead(known[state])]
    failed = list[str]()
    for count in range(1, _MOST_COUPLED + 1):
        for block in combinations(ready, count):
            wanted = sorted(set().union(*(names(waiting[state]) - known.keys() for state in block)))
            if len(wanted) != count:
                continue
            formulas, roots = [waiting[state] for state in block], list[Formula]()
            later = flatness.one_step_later([known[state] for state in block])
            try:
                found = _solve(formulas, later, wanted, known, roots)
            except UnsolvableError:
                failed.append(
                    f"the equation of {_listed(block)} cannot be solved for {_listed(wanted)}: expected a + b·v, where "
                    f"v is {wanted[0]}, or sqrt, exp, log or the reciprocal of c·{wanted[0]} + d"
                )
                continue
            if all(size_and_depth(formula)[0] <= MOST_PARTS for formula in found.values()):
                return block, found, roots
            failed.append(f"the formula of {_listed(wanted)} has more than {MOST_PARTS} parts")
    unsolved = (f"that of {state} has {_listed(names(waiting[state]) - known.keys()) or 'none'}" for state in ready)
    counted = f"no equation has one unknown: {', '.join(unsolved)}" if ready else f"more than {MOST_SHIFTS} steps count"
    raise _StuckError(
        f"from {_listed(known)} at all steps, {failed[0] if failed else counted}", (not failed, len(waiting))
    )


def _listed(names: Iterable[str]) -> str:
    return " and ".join(sorted(names))


def _is_far_ahead(formula: Formula) -> bool:
    return max(subject.indices(z)[1] for z in names(formula)) >= MOST_SHIFTS - 1


def _solve(
    equations: Sequence[Formula],
    values: Sequence[Formula],
    wanted: Sequence[str],
    known: Mapping[str, Formula],
    positive: list[Formula],
) -> dict[str, Formula]:
    """Return the formulas of the `wanted` variables for which the left sides of `equations` have the `values`.

    The equations also contain the `known` variables. A wanted variable in a part √a, exp a, log a or a/b, and nowhere
    else, is found from the part's value v: a = v², log v or exp v, or a = b v. Values of roots are added to `positive`.
    UnsolvableError: other equations than these are not affine in the wanted variables.
    """
    for name in wanted:
        outer = f"({name})"
        part = next((part for of in equations for part in parts(of) if _determines(part, name)), None)
        fewer = substitute(equations, {part: Name(outer)})
        if part is None or any(name in names(of) for of in fewer):
            continue
        found = _solve(fewer, values, [outer if of == name else of for of in wanted], known, positive)
        value, known = found.pop(outer), {**known, **found}
        match part:
            case Operation("/", above, below):
                left: Formula = Operation("-", above, Operation("*", Name(outer), below))
                return found | _solve([left], [Number(0.0)], [name], {**known, outer: value}, positive)
            case Function("sqrt", left):
                positive.append(value)
                value = Power(value, 2.0)
            case Function(function, left):
                value = Function(INVERSES[function], value)
        return found | ({name: value} if isinstance(left, Name) else _solve([left], [value], [name], known, positive))
    right = {f"={i}": value for i, value in enumerate(values)}  # no state has such a name
    solved = inputs_of(equations, list(right), wanted)
    return dict(zip(solved, substitute(list(solved.values()), {**known, **right}), strict=True))


def _determines(part: Formula, name: str) -> bool:
    match part:
        case Function("sqrt" | "exp" | "log", inner) | Operation("/", _, inner):
            return name in names(inner)
    return False


# Headings of flat forms without jumps: atan2 jumps by 2π where a vector crosses the direction of ±π.
#
# A heading matters up to whole turns only, so that formulas that differ by whole turns are equally good. No proof
# relies on this code, because the resulting flat form is verified as any other flat form.

_QUARTER_TURN = pi / 2
_PARTS = 16  # tan(φ/2) is a multiple of 1/16, so that a heading jumps at most 1/16 rad from the intended direction
_MOST_QUARTERS = 16
"""Largest number of quarter turns whose cosines and sines have a normal form (`checker.identities`)."""


def without_jumps(form: FlatForm) -> FlatForm:
    """Return the form with formulas that do not jump when a heading crosses ±π.

    The difference of two headings becomes the angle from one vector to the other, in (−π, π]. Sine and cosine of the
    heading of a vector v = (x, y) become y/|v| and x/|v|.
    """
    smooth = rewritten((*form.states, *form.inputs), _without_jump)
    n = len(form.states)
    return replace(form, states=tuple(smooth[:n]), inputs=tuple(smooth[n:]))


def with_heading_in(form: FlatForm, state: int, bounds: Interval) -> FlatForm:
    """Return the form with another formula of the heading of index `state`, which jumps far away from its bounds.

    It jumps opposite to the middle of `bounds`. So the heading does not jump inside `bounds` [rad] that are up to 6.1
    rad wide. The heading of v = (x, y) becomes n π/2 plus the angle of v turned back by n π/2, where π/2 is atan2(1,
    0), exactly. If the nearest quarter turn is too far from the middle, an angle with rational cosine and sine is
    added. The form is returned unchanged if the state is not the angle of a vector, or if its bounds are wider than a
    turn or more than 16 quarter turns from zero.
    """
    heading = form.states[state]
    if not isinstance(heading, Angle):
        return form
    middle = bounds.lower / 2 + bounds.upper / 2
    n = round(middle / _QUARTER_TURN)
    if abs(n) > _MOST_QUARTERS or bounds.width >= 2 * pi:
        return form
    more = middle - n * _QUARTER_TURN
    parts = round(_PARTS * tan(more / 2)) if abs(more) + bounds.width / 2 >= pi else 0
    if not (n or parts):
        return form
    by = complex(_PARTS**2 - parts**2, 2 * _PARTS * parts) if parts else 1.0  # tan(φ/2) = parts/16 for its angle φ
    turned: Formula = _turn_back(heading, by * (1, 1j, -1, -1j)[n % 4])
    if parts:
        turned = Operation("+", Angle(Number(by.imag), Number(by.real)), turned)
    if n:
        turned = Operation("+", Operation("*", Number(float(n)), Angle(ONE, Number(0.0))), turned)
    return replace(form, states=(*form.states[:state], turned, *form.states[state + 1 :]))


def _turn_back(heading: Angle, by: complex) -> Angle:
    """Return the heading of a vector that is turned back by the angle of the complex number `by`, and scaled."""
    a, b, c = (Number(part) if part else None for part in (by.real, by.imag, -by.imag))
    y, x = plus(times(a, heading.y), times(c, heading.x)), plus(times(a, heading.x), times(b, heading.y))
    assert y is not None, "`by` is not zero"
    assert x is not None
    return Angle(y, x)


def _without_jump(node: Formula, done: Mapping[Formula, Formula]) -> Formula | None:
    """Return the formula that replaces a difference, a sine or a cosine of headings; None for any other formula.

    `done` has the replacements of all operands.
    """
    match node, [done[operand] for operand in operands(node)]:
        case Operation("-", Angle(), Angle()), [Angle(y, x), Angle(y0, x0)]:
            across = Operation("-", Operation("*", x0, y), Operation("*", y0, x))
            return Angle(across, Operation("+", Operation("*", x0, x), Operation("*", y0, y)))
        case Function("sin" | "cos" as name, Angle()), [Angle(y, x)]:
            length = Function("sqrt", Operation("+", Power(x, 2.0), Power(y, 2.0)))
            return Operation("/", y if name == "sin" else x, length)
    return None
