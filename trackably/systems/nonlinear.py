"""Nonlinear systems: with a flat form, or with as many inputs as states, so that the states are flat outputs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import product
from typing import Self

import numpy as np

from trackably.arguments import names, positive
from trackably.arrays import Array
from trackably.checker import subject
from trackably.checker.formulas import Operation, parts, text
from trackably.checker.formulas import names as names_in
from trackably.checker.inverse import UnsolvableError, solved
from trackably.checker.limits import DEPTH
from trackably.checker.subject import shifted_name
from trackably.systems.flat_forms import FlatForm, found_form, why_not_flat, with_heading_in, without_jumps
from trackably.systems.formulas import evaluate_floats, plain_text, size_and_depth, slopes_in_floats
from trackably.systems.linear import Flatness, require_names
from trackably.systems.polytopes import Polytope
from trackably.systems.tracing import Dynamics, require_same_values, trace
from trackably.systems.trajectories import Functional, Trajectory

MAX_SIZE = 1000
"""A formula is refused if it has more operations, names and numbers than this, when it is written out."""
_LONGEST_SHOWN = 80  # most characters of a formula in the repr of a system


@dataclass(frozen=True, eq=False)
class NonlinearSystem(subject.NonlinearSystem):
    """x(k+1) = f(x(k), u(k)), one formula in `f` for each state, one step every `sampling_time` [s].

    Use `of` to get the formulas of a Python function. `states` and `inputs` are different names, and the variables of
    the formulas. The `flat` form gives states and inputs as formulas of flat outputs. If equations can be solved one
    after the other, it is found automatically (`flat_forms.found_form`). Without a flat form, the states are the flat
    outputs: there are as many inputs as states, and f(x, u) = f0(x) + G(x) u is solved for them. ValueError: the flat
    form does not satisfy f; without a flat form, f is not affine in the inputs, or G is singular for all states; a
    formula is too long; a name is invalid (`require_names`); or the sampling time is not positive.
    """

    flat: FlatForm | None = None

    __eq__, __hash__ = object.__eq__, object.__hash__  # by identity; the parent class compares by value

    def __post_init__(self) -> None:
        object.__setattr__(self, "sampling_time", positive("system: sampling_time", self.sampling_time))
        n = len(self.states)
        self._require_formulas()
        if self.flat is None and len(self.inputs) != n:
            try:
                object.__setattr__(self, "flat", found_form(self.f, self.states, self.inputs))
            except UnsolvableError as error:
                raise ValueError(
                    f"system: no flat form is found for {n} states ({', '.join(self.states)}) and {len(self.inputs)} "
                    f"inputs ({', '.join(self.inputs)}): {error}; write f differently, or give flat=FlatForm.of(…). If "
                    "there is none, as for a pole on a cart, LinearSystem.discretised takes a linearised model"
                ) from None
        if self.flat is not None:
            object.__setattr__(self, "flat", without_jumps(self.flat))
            if why := why_not_flat(self, self.flat):
                raise ValueError(f"system: the flat form {why}")
            return
        for node in (part for formula in self._solved.inputs for part in parts(formula)):
            match node:
                case Operation("/", _, pivot) if not names_in(pivot):
                    if not 0 < abs(float(evaluate_floats(pivot, {}))) < np.inf:
                        raise ValueError(
                            f"system: f must be solvable for its inputs, but that would divide by {text(pivot)}, "
                            "which is zero or not finite"
                        )

    def __repr__(self) -> str:
        laws = "; ".join(
            f"{state}(k+1) = {law if len(law) <= _LONGEST_SHOWN else f'{law[:_LONGEST_SHOWN]}…'}"
            for state, law in zip(self.states, map(plain_text, self.f), strict=True)
        )
        return f"NonlinearSystem({laws}; inputs {', '.join(self.inputs)}; one step every {self.sampling_time:g} s)"

    def heading_in(self, state_set: Polytope) -> Self:
        """Return the system with headings that do not jump inside of their bounds in the state set [rad].

        Headings for which this is not possible, and those without bounds, stay as they are.
        """
        if (form := self.flat) is None:
            return self
        for i in map(self.states.index, form.angles):
            if (bounds := state_set.hull.extent(i)) is not None:
                form = with_heading_in(form, i, bounds)
        return self if form is self.flat else replace(self, flat=form)

    def _require_formulas(self) -> None:
        n, every = len(self.states), (*self.states, *self.inputs)
        require_names(every)
        if not n or len({*every}) != len(every):
            raise ValueError(
                f"system: states and inputs need names, all different, got {', '.join(self.states) or 'no states'} and "
                f"{', '.join(self.inputs) or 'no inputs'}"
            )
        if callable(self.f):
            raise TypeError("system: f: expected formulas, got a function; NonlinearSystem.of takes functions")
        if len(self.f) != n:
            raise ValueError(f"system: f must have a formula for each of {n} states, got {len(self.f)} formulas")
        for state, formula in zip(self.states, self.f, strict=True):
            size, depth = size_and_depth(formula)
            if size > MAX_SIZE or depth > DEPTH:
                raise ValueError(
                    f"system: the formula of {state} is too long, with {size} operations, names and numbers when "
                    f"written out, nested {depth} deep; at most {MAX_SIZE} and {DEPTH} are allowed"
                )
            if unknown := names_in(formula) - {*every}:
                raise ValueError(
                    f"system: the formula of {state} uses {', '.join(sorted(unknown))}, which is no state or input; "
                    f"expected {', '.join(every)}"
                )

    @classmethod
    def of(
        cls,
        f: Dynamics,
        states: Sequence[str],
        inputs: Sequence[str],
        sampling_time: float,
        flat: FlatForm | None = None,
    ) -> Self:
        """Return the system of a Python function f(x, u) of two arrays that returns a list of the next states.

        f is called with symbols, so it must use ordinary arithmetic only (see `tracing.Symbol`). Numbers that it uses
        become constants of the system. It is also called with numbers, and has to return the values of its formulas.
        The `flat` form may be left out if `flat_forms.found_form` finds one, or if there are as many inputs as states.
        Raises as the class, ValueError also if f is no such function (the message says why), and TypeError if it is no
        function.
        """
        if not callable(f):
            raise TypeError(f"system: f: expected a function of x and u, got {f!r}")
        x, u = names("system: states", states), names("system: inputs", inputs)
        system = cls(trace(f, x, u), x, u, sampling_time, flat)
        require_same_values(f, system.f, x, u)
        return system

    @cached_property
    def _solved(self) -> FlatForm:
        """The flat form with the states as flat outputs, in which u = G(x)⁻¹ (x⁺ − f0(x)).

        ValueError: f cannot be solved for the inputs.
        """
        try:
            found = solved(self)
        except UnsolvableError as error:
            raise ValueError(f"system: f must be solvable for its inputs, x⁺ = f0(x) + G(x) u, but {error}") from None
        return FlatForm(found.states, found.inputs)

    def successor(self, x: Array, u: Array) -> Array:
        """Return f(x, u) for x (…, n) and u (…, m), with shape (…, n); NaN or infinite where f is undefined."""
        values, shape = self._values(x, u)
        return np.stack([np.broadcast_to(evaluate_floats(of, values), shape) for of in self.f], axis=-1)

    def _values(self, x: Array, u: Array) -> tuple[dict[str, Array], tuple[int, ...]]:
        """Return the values of states and inputs by name, from x (…, n) and u (…, m), and the shape (…)."""
        columns = [np.moveaxis(np.asarray(of, dtype=float), -1, 0) for of in (x, u)]
        values = dict(zip(self.states, columns[0], strict=True)) | dict(zip(self.inputs, columns[1], strict=True))
        return values, np.broadcast_shapes(*(of.shape[1:] for of in columns))

    def slopes(self, x: Array, u: Array) -> tuple[Array, Array]:
        """Return ∂f/∂x and ∂f/∂u at x (…, n) and u (…, m): shapes (…, n, n) and (…, n, m)."""
        values, shape = self._values(x, u)
        by_state = [slopes_in_floats(formula, values) for formula in self.f]
        rows = [[np.broadcast_to(of.get(name, 0.0), shape) for name in values] for of in by_state]
        of_states, of_inputs = np.split(np.moveaxis(np.array(rows), (0, 1), (-2, -1)), [len(self.states)], axis=-1)
        return of_states, of_inputs

    def flatness(self) -> Flatness:
        """Return states and inputs as functions of flat outputs.

        Without a flat form, the states are the flat outputs.
        """
        form, none = self.flat or self._solved, Fraction(0)
        functionals = {
            shifted_name(c, j): Functional(
                none,
                tuple((*[none] * j, Fraction(1)) if d == c else (none,) for d in range(form.outputs)),
                self.sampling_time,
            )
            for c, j in product(range(form.outputs), range(2 + max(form.orders)))
        }
        found = tuple(Trajectory.of_formula(formula, functionals) for formula in (*form.states, *form.inputs))
        return Flatness(found[: len(form.states)], found[len(form.states) :], form.orders)
