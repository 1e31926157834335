"""Names of states and inputs are identifiers: nothing that could be read as a part of a sentence."""

import pytest

from trackably.codec import decode, encode
from trackably.systems.linear import LinearSystem, require_names
from trackably.systems.nonlinear import NonlinearSystem

NAMES = (
    *("x1", "_x", "z_dot", "level-left", "Höhe", "ẋ", "ω_1", "x₁", "Δp", "x" * 60),
    *("q[1][2]", "x(1)", "v(m/s)", "a[m/s²]", "τ[N·m]", "p(kg·m⁻¹)", "T[°C]", "share(%)"),
)
NO_NAMES = (
    *("", " ", "x y", "x ", "1x", "-x", "(m)", "x(m", "x m)", "x()", "x[m](", "x[m s]", "x((m))", "x[m]y"),
    *("x+y", "x,y", "x.y", "x=1", "x≤1", "x'", 'x"y', "x\\y", "x/y", "x⁺", "x\n", "x\ty", "x\x1b[2J"),
    *("\ud800", "x\u202e", "x\u200b", "x\u0307", "ｘ", "х", "א", "٣x", "x٣", "𝑥", "🙂", "x" * 61),
    "state ≤ 0.05, -0.5 ≤ input ≤ 0.5, -2.0 ≤ state",
)


def test_identifiers_are_names() -> None:
    require_names(NAMES)
    for name in NAMES:
        system = LinearSystem([[0.9]], [[0.5]], states=(name,), inputs=("input",), sampling_time=0.1)
        assert decode(LinearSystem, encode(system)).states == (name,)


@pytest.mark.parametrize("name", NO_NAMES, ids=ascii)
def test_anything_else_is_refused_in_one_printable_sentence(name: str) -> None:
    for build in (
        lambda: LinearSystem([[0.9]], [[0.5]], states=(name,), inputs=("input",), sampling_time=0.1),
        lambda: LinearSystem.discretised([[0.9]], [[0.5]], 0.1, states=("state",), inputs=(name,)),
        lambda: NonlinearSystem.of(lambda x, u: [x[0] + u[0]], ("state",), (name,), 0.1),
    ):
        with pytest.raises(ValueError, match=r"^system: a name of a state or an input must be [ -~]{,250}$"):
            build()
