"""Single flat outputs at shifted times, as functionals."""

from fractions import Fraction

from trackably.systems.flat.form import FlatForm, named
from trackably.systems.flat.functional import Functional


def shifted(form: FlatForm, sampling_time: float) -> dict[str, Functional]:
    """Return all z_c(t + j T_s) by name, one step further than states and inputs need them."""
    longest = 2 + max(form.orders)
    return {
        named(c, j): one_of(c, form.outputs, tuple(Fraction(int(i == j)) for i in range(longest)), sampling_time)
        for c in range(form.outputs)
        for j in range(longest)
    }


def one_of(signal: int, count: int, weights: tuple[Fraction, ...], sampling_time: float) -> Functional:
    """Return Σ_j `weights`[j] z(t + j T_s) of one of `count` signals."""
    zero = tuple(Fraction(0) for _ in weights)
    return Functional(tuple(weights if c == signal else zero for c in range(count)), Fraction(0), sampling_time)
