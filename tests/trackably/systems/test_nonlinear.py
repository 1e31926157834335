"""Nonlinear systems: solved for the input in many digits, and refused where that cannot be."""

import numpy as np
import pytest

from tests.trackably.systems.nonlinear_instances import INSTANCES, T_S, moving
from trackably.checker.formulas import Name
from trackably.systems.nonlinear import NonlinearSystem


@pytest.mark.parametrize(("states", "inputs"), [(3, 1), (1, 3), (2, 1)])
def test_states_and_inputs_of_other_sizes_are_refused(states, inputs):
    """Once a state too many was taken for an input that was missing."""
    with pytest.raises(ValueError, match="zip"):
        INSTANCES["reactor"].system.successor(np.ones(states), np.ones(inputs))


def test_where_a_formula_is_not_defined_the_margin_is_infinitely_negative():
    reference = moving(INSTANCES["tank"], size=5.0)
    quantity, t = reference.quantity("inflow"), np.linspace(0, 4, 400)
    undefined = reference.state_at(t)[:, 0] < 0
    assert undefined.any()
    assert not undefined.all()
    assert np.all(quantity.margin(reference.signals, t)[undefined] == -np.inf)
    assert np.all(np.isfinite(quantity.margin(reference.signals, t)[~undefined]))
    assert np.isnan(quantity.at_rest([-1.0]))


def test_formulas_hold_states_and_inputs_only():
    with pytest.raises(ValueError, match="uses nobody, which is no state or input"):
        NonlinearSystem((Name("nobody"),), ("a",), ("p",), T_S)


AFFINE = "must be solvable for its inputs, .*, but f is not affine in p: it holds "
REFUSED = {
    "a product": (lambda x, u: [u[0] * x[0] * u[0]], rf'{AFFINE}\(\("p" \* "a"\) \* "p"\)'),
    "a function": (lambda x, u: [x[0] + np.sin(u[0] + x[0])], rf'{AFFINE}sin\(\("p" \+ "a"\)\)'),
    "no input": (lambda x, u: [x[0]], "must be solvable for its inputs, .* f cannot be solved"),
    "an effect that cancels": (lambda x, u: [x[0] + u[0] - u[0]], r"but that would divide by \(1.0 - 1.0\)"),
    "a cube that drives": (
        lambda x, u: [x[0] + x[1] ** 3, u[0]],
        "from a at all steps, the equation of a cannot be solved for b: expected a.* as for a pole on a cart",
    ),
    "a long formula": (
        lambda x, u: [sum(x[0] ** i for i in range(2, 300)) + u[0]],
        "is too long.* 1000 and 100 are",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_f_that_cannot_be_solved_is_refused(name):
    f, reason = REFUSED[name]
    with pytest.raises(ValueError, match=reason):
        NonlinearSystem.of(f, ("a", "b")[: 1 + ("drives" in name)], ("p",), T_S)
