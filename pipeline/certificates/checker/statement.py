"""What a certificate proves, in words and numbers."""

from typing import Any

from pipeline.certificates.checker.formulas import text
from pipeline.certificates.checker.quantities import is_nonlinear, successors


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
    held = []
    for bound in certificate["bounds"]:
        weighted = [
            name if r == 1 else f"{r!r} {name}" for r, name in zip(bound["row"], names[bound["of"]], strict=True) if r
        ]
        held.append(f"{bound['lower']!r} ≤ {' + '.join(weighted)} ≤ {bound['upper']!r}")
    return (
        f"For {times[claim['kind']]} the reference keeps {', '.join(held)}, and the system {_dynamics(certificate)} "
        f"follows it with these inputs "
        f"(T = {system['sampling_time']!r} s). The bounds hold with room for the error of float64 evaluation at times "
        f"up to {certificate['evaluation']['until']:g} s."
    )


def _dynamics(certificate: Any) -> str:
    system = certificate["system"]
    if is_nonlinear(certificate):
        laws = zip(successors(certificate), system["f"], strict=True)
        return ", ".join(f"{name} = {text(tree)}" for name, tree in laws)
    return f"x⁺ = A x + B u + c with A = {system['A']!r}, B = {system['B']!r}, c = {system['c']!r}"
