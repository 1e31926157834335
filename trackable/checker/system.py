"""The first step of the proof: shapes and names fit, and the system follows its states with its inputs."""

from fractions import Fraction
from typing import Any

from trackable.checker.formulas import names
from trackable.checker.intervals import exact_sum
from trackable.checker.quantities import is_nonlinear, successors


def check_shapes(certificate: Any) -> str | None:
    """Matrices, formulas, trajectories and bounds are those of one system, and names are the same everywhere."""
    system, signals = certificate["system"], certificate["signals"]
    n, m = len(system["states"]), len(system["inputs"])
    if any(len(signal["centres"]) != len(signal["weights"]) for signal in signals):
        return "signals: there must be as many centres as weights"
    sizes = {"state": n, "input": m}
    if any(len(bound["row"]) != sizes[bound["of"]] or not any(bound["row"]) for bound in certificate["bounds"]):
        return "shapes: every bound needs a row with a number for each state, or for each input, not all zero"
    if reason := (_misfit_of_formulas if is_nonlinear(certificate) else _misfit_of_matrices)(certificate, n, m):
        return reason
    return _misfit_of_names(certificate)


def _misfit_of_names(certificate: Any) -> str | None:
    system = certificate["system"]
    coordinates = [*system["states"], *system["inputs"]]
    if len(set(coordinates)) != len(coordinates):
        return "names: states and inputs must all be called differently"
    bounded = [bound["name"] for bound in certificate["bounds"]]
    given = [certificate["evaluation"]["errors"], certificate["claim"].get("covers", bounded)]
    if len(set(bounded)) != len(bounded) or any(sorted(some) != sorted(bounded) for some in given):
        return "names: the bounds, the evaluation errors and the covers must have the same names, each once"
    return None


def _misfit_of_matrices(certificate: Any, n: int, m: int) -> str | None:
    system, trajectories, signals = certificate["system"], certificate["trajectories"], certificate["signals"]
    if (
        [len(row) for row in system["A"]] != [n] * n
        or [len(row) for row in system["B"]] != [m] * n
        or len(system["c"]) != n
        or [len(trajectories[side]) for side in ("states", "inputs")] != [n, m]
    ):
        return "shapes: A, B, c, names and trajectories are not those of one system"
    for parts in trajectories.values():
        looks = [len(weights) for weights in parts[0]["weights"]]
        if len(looks) != len(signals) or any([len(w) for w in part["weights"]] != looks for part in parts):
            return "shapes: every state and every input needs weights of the same shape, for each signal"
    return None


def _misfit_of_formulas(certificate: Any, n: int, m: int) -> str | None:
    system = certificate["system"]
    if not len(system["f"]) == len(certificate["signals"]) == n == m:
        return "shapes: as many formulas, signals, states and inputs are needed"
    known = {*system["states"], *system["inputs"]}
    if len({*known, *successors(certificate)}) != 3 * n:
        return "names: states, states⁺ and inputs must all be called differently"
    if unknown := {name for tree in system["f"] for name in names(tree)} - known:
        return f"names: f must hold states and inputs only, but holds {', '.join(sorted(unknown))}"
    rows = [bound["row"] for bound in certificate["bounds"] if bound["of"] == "input"]
    free = [name for i, name in enumerate(system["inputs"]) if not any(row[i] for row in rows)]
    if free:  # only in bounded quantities are formulas shown to be defined
        return f"bounds: every input of a nonlinear system must be bounded, but {', '.join(free)} is not"
    return None


def check_trajectories(certificate: Any) -> str | None:
    """x(t + T) = A x(t) + B u(t) + c whatever the signals are; where f is solved for u there is nothing to check."""
    if is_nonlinear(certificate):
        return None
    system, trajectories = certificate["system"], certificate["trajectories"]
    states, inputs = trajectories["states"], trajectories["inputs"]
    A, B = ([[Fraction(v) for v in row] for row in system[matrix]] for matrix in "AB")

    def follows(x: list[Fraction], u: list[Fraction], successor: list[Fraction], c: list[float]) -> bool:
        led = (exact_sum(a * v for a, v in zip(row, x, strict=True)) for row in A)
        pushed = (exact_sum(b * v for b, v in zip(row, u, strict=True)) for row in B)
        return all(s == p + q + Fraction(r) for s, p, q, r in zip(successor, led, pushed, c, strict=True))

    def column(parts: Any, s: int, j: int) -> list[Fraction]:
        return [part["weights"][s][j] if 0 <= j < len(part["weights"][s]) else Fraction(0) for part in parts]

    start = [part["offset"] for part in states]
    if not follows(start, [part["offset"] for part in inputs], start, system["c"]):
        return "trajectories: the system does not stay where its state and input are the offsets"
    for s in range(len(certificate["signals"])):
        for j in range(max(len(parts[0]["weights"][s]) for parts in (states, inputs)) + 1):
            if not follows(column(states, s, j), column(inputs, s, j), column(states, s, j - 1), [0.0] * len(A)):
                return f"trajectories: the system does not follow signal {s} with the weights of shift {j}"
    return None
