"""What is bounded, as the certificate defines it: formulas of weighted sums of the signals at shifted times."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from trackable.checker.affine import inputs_of
from trackable.checker.formulas import Formula, names
from trackable.checker.intervals import Real, exact_sum, iv, ratio
from trackable.checker.kernels import pairs


@dataclass(frozen=True)
class Look:
    """offset + Σ_s Σ_j w_sj (z_s(t + j T) − m_s) with `weights[s][j]` = w_sj; offset is its value at rest.

    `gross[s]` and `gross_offset` are what the sizes of w_s and of the constants add up to if nothing cancels.
    """

    weights: list[list[Fraction]]
    offset: Real
    gross: list[Fraction]
    gross_offset: Fraction


@dataclass(frozen=True)
class Quantity:
    """A formula of looks at the signals, by name.

    `parts` are those of inputs that are formulas, with their weights in the row; none of functionals. [lower, upper]
    are the certificate's bounds, drawn in by its evaluation error.
    """

    name: str
    formula: Formula
    looks: Mapping[str, Look]
    parts: list[tuple[Fraction, Formula]]
    lower: Real
    upper: Real


def is_nonlinear(certificate: Any) -> bool:
    """Whether its system is given by formulas."""
    return "f" in certificate["system"]


def successors(certificate: Any) -> list[str]:
    """What the states one step later are called."""
    return [f"{name}⁺" for name in certificate["system"]["states"]]


def quantities(certificate: Any) -> list[Quantity]:
    """All that is bounded. UnsolvableError where f cannot be solved for the inputs."""
    solved = {}
    if is_nonlinear(certificate):
        system = certificate["system"]
        solved = inputs_of(system["f"], successors(certificate), system["inputs"])
    return [_quantity(certificate, bound, solved) for bound in certificate["bounds"]]


def _quantity(certificate: Any, bound: Any, solved: Mapping[str, Formula]) -> Quantity:
    away = iv.mpf(certificate["evaluation"]["errors"][bound["name"]])
    lower, upper = iv.mpf(bound["lower"]) + away, iv.mpf(bound["upper"]) - away
    row = [Fraction(r) for r in bound["row"]]
    if not (solved and bound["of"] == "input"):
        look = _combined(certificate, row, functionals(certificate, f"{bound['of']}s"))
        return Quantity(bound["name"], "itself", {"itself": look}, [], lower, upper)
    parts = [(r, solved[u]) for r, u in zip(row, certificate["system"]["inputs"], strict=True) if r]
    tree: Formula = None
    for r, part in parts:
        term = part if r == 1 else ("*", float(r), part)
        tree = term if tree is None else ("+", tree, term)
    held = names(tree)
    looks = {name: look for name, look in _states_and_successors(certificate).items() if name in held}
    return Quantity(bound["name"], tree, looks, parts, lower, upper)


def functionals(certificate: Any, side: str) -> list[Any]:
    """The states or inputs of a linear system, or the states of a nonlinear one, which are the signals."""
    if not is_nonlinear(certificate):
        found: list[Any] = certificate["trajectories"][side]
        return found
    return [_signal(certificate, i, (1,)) for i in range(len(certificate["signals"]))]


def _signal(certificate: Any, i: int, weights: tuple[int, ...]) -> Any:
    alone = [[Fraction(w if s == i else 0) for w in weights] for s in range(len(certificate["signals"]))]
    return {"offset": Fraction(0), "weights": alone}


def _states_and_successors(certificate: Any) -> dict[str, Look]:
    looks = {}
    for i, (now, later) in enumerate(zip(certificate["system"]["states"], successors(certificate), strict=True)):
        looks[now] = _combined(certificate, [Fraction(1)], [_signal(certificate, i, (1,))])
        looks[later] = _combined(certificate, [Fraction(1)], [_signal(certificate, i, (0, 1))])
    return looks


def _combined(certificate: Any, row: list[Fraction], parts: list[Any]) -> Look:
    """Σ_i row_i part_i."""
    counts = [len(weights) for weights in parts[0]["weights"]]
    weights = [
        [exact_sum(r * part["weights"][s][j] for r, part in zip(row, parts, strict=True)) for j in range(count)]
        for s, count in enumerate(counts)
    ]
    gross = [
        exact_sum(abs(r * w) for r, part in zip(row, parts, strict=True) for w in part["weights"][s])
        for s in range(len(counts))
    ]
    at_rest = exact_sum(r * part["offset"] for r, part in zip(row, parts, strict=True)) + exact_sum(
        w * Fraction(signal["mean"])
        for signal, of_signal in zip(certificate["signals"], weights, strict=True)
        for w in of_signal
    )
    offsets = exact_sum(abs(r * part["offset"]) for r, part in zip(row, parts, strict=True))
    return Look(weights, ratio(at_rest), gross, offsets)


def summands(certificate: Any, look: Look) -> Iterator[tuple[Any, Real, Real, Real]]:
    """All w c κ(t + s − t_i) of a look: the kernel, w c, s and t_i."""
    step = iv.mpf(certificate["system"]["sampling_time"])
    for signal, weights in zip(certificate["signals"], look.weights, strict=True):
        for j, w in enumerate(weights):
            for t, c in pairs(signal) if w else ():
                yield signal["kernel"], ratio(w) * c, j * step, t
