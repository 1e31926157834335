"""What a certificate proves, in words and numbers."""

from fractions import Fraction
from typing import Any

from trackable.checker.formulas import text
from trackable.checker.quantities import is_nonlinear, successors


def statement(certificate: Any) -> str:
    """What is proved, in words and numbers."""
    claim, system = certificate["claim"], certificate["system"]
    times = {
        "all_times": "all real t ≥ 0",
        "all_phases": "all real t",
        "window": f"all real t from {claim.get('start')!r} s to {claim.get('end')!r} s",
        "instants": "all sampled instants t = k T, k = 0, 1, 2, …",
    }
    names = {"state": system["states"], "input": system["inputs"]}
    held = ", ".join(_bound(bound, names[bound["of"]]) for bound in certificate["bounds"])
    inputs = "these inputs"
    if "input_set" in certificate:
        kept = ", ".join(_bound(bound, system["inputs"]) for bound in certificate["input_set"])
        inputs = f"inputs that push alike (they differ by v with B v = 0) and keep {kept}"
    return (
        f"For {times[claim['kind']]} the reference keeps {held}, and the system {_dynamics(certificate)} "
        f"follows it with {inputs} "
        f"(T = {system['sampling_time']!r} s). The bounds hold with room for the error of float64 evaluation at times "
        f"up to {certificate['evaluation']['until']:g} s."
    )


def _bound(bound: Any, names: list[str]) -> str:
    weighted = [name if r == 1 else f"{_number(r)} {name}" for r, name in zip(bound["row"], names, strict=True) if r]
    return f"{bound['lower']!r} ≤ {' + '.join(weighted)} ≤ {bound['upper']!r}"


def _number(r: float | Fraction) -> str:
    return str(r) if isinstance(r, Fraction) else repr(r)


def _dynamics(certificate: Any) -> str:
    system = certificate["system"]
    if is_nonlinear(certificate):
        laws = zip(successors(certificate), system["f"], strict=True)
        return ", ".join(f"{name} = {text(tree)}" for name, tree in laws)
    return f"x⁺ = A x + B u + c with A = {system['A']!r}, B = {system['B']!r}, c = {system['c']!r}"
