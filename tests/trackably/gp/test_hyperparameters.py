"""Hyperparameters: checked on entry, read out by name, known or learned wherever a kernel or a prior moves."""

import copy
import math
import pickle
from dataclasses import fields, replace
from itertools import product

import pytest

from tests.trackably.gp.instances import REPRESENTATIVE, over
from trackably.gp.hyperparameter import Learned
from trackably.gp.joint import JointPrior
from trackably.gp.kernels import registry
from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.elementary import Elementary
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.squared_exponential import SquaredExponential
from trackably.gp.prior import Prior

ELEMENTARY = {name: family for name, family in registry.KERNELS.items() if issubclass(family, Elementary)}
NESTED = REPRESENTATIVE["nested"]
OWNERS = REPRESENTATIVE | {
    "prior": Prior(NESTED, 0.1, 0.3),
    "joint": JointPrior((Prior(NESTED, 0.1), Prior(NESTED, 0.2)), ("x", "y"), frozenset({"right.left.period"})),
}


def learned(owner) -> dict[str, tuple[float, float] | None]:
    return {name: v.interval for name, v in owner.hyperparameters.items() if isinstance(v, Learned)}


@over(ELEMENTARY, "family")
def test_wrong_values_and_names_are_refused_by_name(family):
    names = [field.name for field in fields(family)]
    kernel = family(*[0.5] * len(names))
    for name, bad in product(names, (-1.0, 0.0, math.nan, math.inf)):
        with pytest.raises(ValueError, match=rf"^{family.__name__}: {name} must be a positive number .*, got {bad!r}$"):
            kernel.with_hyperparameters({name: bad})
    with pytest.raises(TypeError, match="has no hyperparameter 'length_scale'; it has signal_std"):
        family(length_scale=1.0)
    for combined in (kernel, Sum(kernel, kernel), Prior(kernel)):
        with pytest.raises(TypeError, match=r"left\.wavelength"):
            combined.with_hyperparameters({"left.wavelength": 1.0})


@over(ELEMENTARY, "family")
def test_a_number_is_known_a_pair_is_the_interval_and_nothing_is_learned(family):
    names = [field.name for field in fields(family)]
    assert learned(family()) == dict.fromkeys(names)
    assert learned(family(*[0.5] * len(names))) == {}
    for name in names:
        assert learned(family(**{name: 0.5})) == dict.fromkeys(n for n in names if n != name)
        within = family(**{name: (0.5, 8)})
        assert learned(within) == {**dict.fromkeys(names), name: (0.5, 8.0)}
        assert getattr(within, name) == 2.0
        assert isinstance(getattr(family(**{name: 1}), name), float)


@over(OWNERS, "owner")
def test_what_is_learned_stays_so_wherever_it_moves(owner):
    some = owner.as_learned([*owner.hyperparameters][::2])
    assert [*learned(some)] == [*owner.hyperparameters][::2]
    assert learned(owner) == {}
    assert some.hyperparameters == owner.hyperparameters
    name = next(iter(owner.hyperparameters))
    given = some.map_values(lambda n, value: Learned(value, (0.1, 9.0)) if n == name else value)
    moved = given.with_hyperparameters({n: 1.1 * v for n, v in owner.hyperparameters.items()})
    assert learned(moved) == learned(given) == {**learned(some), name: (0.1, 9.0)}
    for again in (copy.deepcopy(moved), pickle.loads(pickle.dumps(moved)), moved.as_learned(learned(moved))):
        assert (again, learned(again)) == (moved, learned(moved))
    assert learned(moved.as_known()) == {}
    assert all(type(value) is float for value in moved.as_known().hyperparameters.values())


def test_kernels_add_and_multiply():
    one, other, third = SquaredExponential(1.0, 0.2), Periodic(1.0, 1.0, 0.3), SquaredExponential(0.5, 2.0)
    assert one + other * third == Sum(one, Product(other, third))
    assert one * other + third == Sum(Product(one, other), third)
    with pytest.raises(TypeError, match="right must be a kernel, got"):
        one + 1.0


def test_a_period_is_that_of_both_parts():
    same, other, never = Periodic(2.0, 0.3, 1.5), Periodic(1.0, 1.0, 3.0), SquaredExponential(1.0, 1.0)
    assert (same.period, never.period) == (1.5, None)
    assert (same + replace(other, period=1.5)).period == (same * (same + same)).period == 1.5
    assert [kernel.period for kernel in (same + other, same * never, never + never)] == [None] * 3
