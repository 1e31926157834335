"""Names and values of a kernel's hyperparameters: checked on entry, read out, put back."""

import math

import pytest

from tests.trackably.gp.instances import FAMILIES, over
from trackably.gp.kernels.base import Product, Sum
from trackably.gp.kernels.elementary import Elementary
from trackably.gp.kernels.periodic import Periodic
from trackably.gp.kernels.rational_quadratic import RationalQuadratic
from trackably.gp.kernels.squared_exponential import SquaredExponential

ELEMENTARY = {name: kernel for name, kernel in FAMILIES.items() if isinstance(kernel, Elementary)}
BAD = [-1.0, 0.0, math.nan, math.inf]


@over(ELEMENTARY)
@pytest.mark.parametrize("bad", BAD)
def test_an_impossible_value_is_refused_by_name(kernel, bad):
    for name in kernel.hyperparameters:
        said = rf"^{type(kernel).__name__}: {name} must be a positive number \(known\) or .*, got {bad!r}$"
        with pytest.raises(ValueError, match=said):
            kernel.with_hyperparameters({name: bad})


@over(ELEMENTARY)
def test_a_hyperparameter_that_there_is_not_is_refused_by_name(kernel):
    family, known = type(kernel), ", ".join(kernel.hyperparameters)
    with pytest.raises(TypeError, match=f"^{family.__name__} has no hyperparameter 'length_scale'; it has {known}$"):
        family(length_scale=1.0)
    with pytest.raises(TypeError, match=f"^{family.__name__} takes {known}, got 9 values$"):
        family(*[1.0] * 9)
    for combined in (kernel, Sum(kernel, kernel)):
        with pytest.raises(TypeError, match=r"left\.wavelength"):
            combined.with_hyperparameters({"left.wavelength": 1.0})


def test_names_tell_where_they_belong():
    kernel = Product(Sum(SquaredExponential(1.0, 2.0), RationalQuadratic(3.0, 4.0, 5.0)), Periodic(6.0, 7.0, 8.0))
    assert kernel.hyperparameters == {
        "left.left.signal_std": 1.0,
        "left.left.lengthscale": 2.0,
        "left.right.signal_std": 3.0,
        "left.right.lengthscale": 4.0,
        "left.right.shape": 5.0,
        "right.signal_std": 6.0,
        "right.lengthscale": 7.0,
        "right.period": 8.0,
    }
    assert kernel.with_hyperparameters({"left.right.shape": 9.0}).left.right == RationalQuadratic(3.0, 4.0, 9.0)
