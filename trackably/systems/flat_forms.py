"""Flat forms of nonlinear systems: states and inputs as formulas of flat outputs at this step and at later ones."""

from collections.abc import Callable, Mapping, Sequence
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
    rewritten,
    shared_parts,
)
from trackably.checker.inverse import UnsolvableError, inputs_of
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
        every = {name: self._indices(name) for formula in self._formulas for name in names(formula)}
        shared = iter(shared_parts(self._formulas))  # equal subformulas become one object
        for name in ("states", "inputs", "positive"):
            object.__setattr__(self, name, tuple(next(shared) for _ in getattr(self, name)))
        if missing := {*range(1 + max((c for c, _ in every.values()), default=0))} - {c for c, _ in self.indices}:
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

    @property
    def _formulas(self) -> tuple[Formula, ...]:
        return (*self.states, *self.inputs, *self.positive)

    def _indices(self, name: str) -> tuple[int, int]:
        try:
            c, j = subject.indices(name)
        except ValueError:
            j = MOST_SHIFTS + 1
        if j > MOST_SHIFTS:
            raise ValueError(
                f"flat form: expected formulas of flat outputs z1[0] to z99[{MOST_SHIFTS}] only, got one with {name}"
            )
        return c, j


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
        return f"is not proved to satisfy f, as {str(error).removeprefix('flat: ')}"
    return None


# Find flat forms of systems whose equations can be solved one after the other, in small blocks.
#
# As many states as there are inputs are taken for flat outputs. If x_i is known and its equation x_i⁺ = f_i contains
# one unknown v, with f_i = a + b v or f_i = a + b √v, then v is (x_i⁺ − a)/b, or for the root the square of this
# quotient, and the quotient is assumed to be positive. If no equation has a single unknown, two or three equations that
# are affine in as many unknowns, or in the roots of the unknowns, are solved together. If all states and inputs are
# known in the end, their formulas are a flat form.

_MOST_CHOICES = 2000  # choices of states as flat outputs; if there are more, no flat form is searched
_ROOT = "√"
_MOST_COUPLED = 3  # largest number of equations that are solved together


def found_form(f: Sequence[Formula], states: Sequence[str], inputs: Sequence[str]) -> FlatForm | None:
    """Return the first flat form found whose flat outputs are some of the states; None if none is found."""
    if not inputs or comb(len(states), len(inputs)) > _MOST_CHOICES:
        return None
    choices = combinations(range(len(states)), len(inputs))
    return next((form for choice in choices if (form := _form_of_choice(f, states, inputs, choice)) is not None), None)


def _form_of_choice(
    f: Sequence[Formula], states: Sequence[str], inputs: Sequence[str], choice: tuple[int, ...]
) -> FlatForm | None:
    known: dict[str, Formula] = {states[i]: Name(shifted_name(c, 0)) for c, i in enumerate(choice)}
    positive: list[Formula] = []
    waiting = dict(zip(states, f, strict=True))
    while waiting:
        block = _solve_block(waiting, {*states, *inputs} - {*known}, known)
        if block is None:
            return None
        solved, found, roots = block
        waiting = {state: formula for state, formula in waiting.items() if state not in solved}
        known |= found
        positive += roots
    if known.keys() != {*states, *inputs}:
        return None
    return FlatForm(
        tuple(known[name] for name in states), tuple(known[name] for name in inputs), positive=tuple(positive)
    )


def _solve_block(
    waiting: Mapping[str, Formula], unknown: set[str], known: Mapping[str, Formula]
) -> tuple[tuple[str, ...], dict[str, Formula], list[Formula]] | None:
    """Find a smallest set of equations with exactly as many unknowns, and solve it for the unknowns.

    Return the states x_i whose equations x_i⁺ = f_i these are, the formulas of the unknowns, and the formulas whose
    squares are unknowns. None if there is no set that can be solved.
    """
    ready = [state for state in waiting if state in known and not _is_far_ahead(known[state])]
    for count in range(1, _MOST_COUPLED + 1):
        for block in combinations(ready, count):
            wanted = sorted(set().union(*(names(waiting[state]) & unknown for state in block)))
            if len(wanted) != count:
                continue
            formulas, variables = [waiting[state] for state in block], dict(zip(wanted, wanted, strict=True))
            for name in wanted:
                rooted = _name_roots(formulas, name)
                if not any(name in names(formula) for formula in rooted):
                    formulas, variables[name] = rooted, _ROOT + name
            later = {f"{state}⁺": of for state in block for of in flatness.one_step_later([known[state]])}
            try:
                solved = inputs_of(formulas, list(later), list(variables.values()))
            except UnsolvableError:
                continue
            found = dict(zip(solved, substitute(list(solved.values()), {**known, **later}), strict=True))
            if all(size_and_depth(formula)[0] <= MOST_PARTS for formula in found.values()):
                roots = {name: found.pop(variable) for name, variable in variables.items() if variable != name}
                squares = {name: Power(root, 2.0) for name, root in roots.items()}
                return block, found | squares, list(roots.values())
    return None


def _is_far_ahead(formula: Formula) -> bool:
    return max(subject.indices(z)[1] for z in names(formula)) >= MOST_SHIFTS - 1


def _name_roots(formulas: Sequence[Formula], name: str) -> list[Formula]:
    """Return formulas in which each √`name`, the root of a variable, is replaced by one new variable."""

    def named(node: Formula, _: Mapping[Formula, Formula]) -> Formula | None:
        match node:
            case Function("sqrt", Name(own)) if own == name:
                return Name(_ROOT + name)
        return None

    return rewritten(formulas, named)


# Headings of flat forms without jumps: atan2 jumps by 2π where a vector crosses the direction of ±π.
#
# A heading matters up to whole turns only, so that formulas that differ by whole turns are equally good. No proof
# relies on this code, because the resulting flat form is verified as any other flat form.

_NOTHING, _QUARTER_TURN = Number(0.0), pi / 2
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
    turned: Formula = _turn_back(heading, n)
    more = middle - n * _QUARTER_TURN
    if (parts := round(_PARTS * tan(more / 2))) and abs(more) + bounds.width / 2 >= pi:
        turned = _turn_by(_turn_back(heading, n), parts)
    elif n == 0:
        return form
    if n:
        turned = Operation("+", Operation("*", Number(float(n)), Angle(ONE, _NOTHING)), turned)
    return replace(form, states=(*form.states[:state], turned, *form.states[state + 1 :]))


def _turn_back(heading: Angle, quarters: int) -> Angle:
    y, x = heading.y, heading.x
    return (heading, Angle(_negative(x), y), Angle(_negative(y), _negative(x)), Angle(x, _negative(y)))[quarters % 4]


def _turn_by(heading: Angle, parts: int) -> Formula:
    """Return a heading as φ + (the heading turned back by φ), where tan(φ/2) = parts/16, so that
    cos φ and sin φ are rational.
    """
    a, b = Number(float(_PARTS**2 - parts**2)), Number(float(2 * _PARTS * parts))
    y, x = heading.y, heading.x
    back = Angle(
        Operation("-", Operation("*", a, y), Operation("*", b, x)),
        Operation("+", Operation("*", a, x), Operation("*", b, y)),
    )
    return Operation("+", Angle(b, a), back)


def _negative(formula: Formula) -> Formula:
    return Operation("*", Number(-1.0), formula)


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
