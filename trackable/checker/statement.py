"""What a certificate proves, in words and numbers."""

from fractions import Fraction

from trackable.checker.certificate import (
    AllPhases,
    AllTimes,
    Bound,
    Certificate,
    Claim,
    Instants,
    NonlinearSystem,
    Row,
    System,
    Window,
    as_float,
)
from trackable.checker.formulas.formula import text


def statement(certificate: Certificate) -> str:
    """Return what is proved."""
    system = certificate.system
    names = {"state": system.states, "input": system.inputs}
    kept = ", ".join(_bound(bound, names[bound.of]) for bound in certificate.bounds)
    inputs = "these inputs"
    if certificate.attainable is not None:
        rows = ", ".join(_bound(row, system.inputs) for row in certificate.input_set.rows)
        inputs = f"inputs that push alike (they differ by v with B v = 0) and keep {rows}"
    return (
        f"For {_times(certificate.claim)} the reference keeps {kept}, and the system {_dynamics(system)} "
        f"follows it with {inputs} "
        f"(T = {system.sampling_time!r} s). The bounds hold with room for the error of float64 evaluation at times "
        f"up to {certificate.until:g} s."
    )


def _times(claim: Claim) -> str:
    match claim:
        case AllTimes():
            return "all real t ≥ 0"
        case AllPhases():
            return "all real t"
        case Window(start, end):
            return f"all real t from {start!r} s to {end!r} s"
        case Instants():
            return "all sampled instants t = k T, k = 0, 1, 2, …"


def _bound(bound: Bound | Row, names: tuple[str, ...]) -> str:
    weighted = [name if r == 1 else f"{_number(r)} {name}" for r, name in zip(bound.row, names, strict=True) if r]
    return f"{bound.lower!r} ≤ {' + '.join(weighted)} ≤ {bound.upper!r}"


def _number(r: Fraction) -> str:
    nearest = as_float(r)
    return repr(nearest) if abs(nearest) < float("inf") and Fraction(nearest) == r else str(r)


def _dynamics(system: System) -> str:
    if isinstance(system, NonlinearSystem):
        laws = zip(system.successors, system.f, strict=True)
        return ", ".join(f"{name} = {text(formula)}" for name, formula in laws)
    A, B = ([list(row) for row in matrix] for matrix in (system.A, system.B))
    return f"x⁺ = A x + B u + c with A = {A!r}, B = {B!r}, c = {list(system.c)!r}"
