"""Rounding: the distances from the bounds exceed the errors of float64 evaluation."""

from fractions import Fraction
from typing import Any

from trackable.checker.formulas import UndefinedError, evaluate, operands, written
from trackable.checker.intervals import SIGN, ZERO, Real, at_most, exact_sum, iv, ratio
from trackable.checker.kernels import beyond, elementary, fold, pairs
from trackable.checker.quantities import Look, Quantity, functionals, is_nonlinear
from trackable.checker.rounded import Rounded, RoundedFormulas
from trackable.checker.shapes import KERNELS

_UNIT = iv.mpf(2) ** -53
_TINY = iv.mpf(2) ** -300


def check_sizes(certificate: Any, quantities: list[Quantity]) -> str | None:
    """No number is so large, or so small, that float64 evaluation could overflow or lose a factor altogether."""
    numbers: list[float] = []
    positive: list[float] = [certificate["system"]["sampling_time"]]
    for signal in certificate["signals"]:
        numbers += [*signal["centres"], *signal["weights"], signal["mean"]]
        positive += [part[name] for part in elementary(signal["kernel"]) for name in KERNELS[part["type"]]]
    looks = [look for q in quantities for look in q.looks.values()]
    factors = [size for look in looks for size in (*look.gross, look.gross_offset) if size]
    factors += [abs(r) for q in quantities for r, _ in q.parts]
    factors += [abs(Fraction(v)) for tree in certificate["system"].get("f", ()) for v in _numbers(tree) if v]
    positive += [float(min(max(factor, Fraction(1, 10**40)), Fraction(10**40))) for factor in factors]
    if max(map(abs, [*numbers, *positive])) > 1e30 or min(positive) < 1e-30:
        return "sizes: some number is too large or too small for the analysis of rounding"
    if certificate["evaluation"]["until"] > 1e60 or not all(
        at_most(beyond(signal["kernel"], ZERO)[0], 1e100) for signal in certificate["signals"]
    ):
        return "sizes: some value could overflow in float64 evaluation"
    return None


def _numbers(tree: Any) -> list[float]:
    """Constants and exponents of a formula."""
    nodes = list(written(tree))
    exponents = [node[2] for node in nodes if isinstance(node, tuple) and node[0] == "^"]
    return [node for node in nodes if not operands(node) and not isinstance(node, str)] + exponents


def check_rounding(certificate: Any, quantities: list[Quantity]) -> str | None:
    """Errors of first order in u, and a per cent; of formulas, carried from operation to operation."""
    errors = certificate["evaluation"]["errors"]
    of_signals = [_signal_error(certificate, signal) for signal in certificate["signals"]]
    for q in quantities:
        try:
            error = _error(certificate, q, of_signals)
        except UndefinedError as undefined:
            return f"evaluation: the error of the {q.name} in float64 is not bounded: {undefined}"
        if not at_most(error, errors[q.name]):
            return f"evaluation: the {q.name} can be off by more than {errors[q.name]!r} in float64"
    return None


def _error(certificate: Any, q: Quantity, of_signals: list[tuple[Real, Real]]) -> Real:
    if not q.parts:
        (look,) = q.looks.values()
        return _look(certificate, look, of_signals).error
    values = {name: _look(certificate, look, of_signals) for name, look in q.looks.items()}
    for i, state in enumerate(certificate["system"]["states"]):
        if state in values:  # bounds of states are proved without any use of this step
            values[state] = Rounded(_within(certificate, i, values[state].exact), values[state].error)
    error, size = ZERO, ZERO
    for r, part in q.parts:
        found: Rounded = evaluate(part, values, RoundedFormulas())
        error, size = error + abs(ratio(r)) * found.error, size + abs(ratio(r)) * abs(found.seen)
    return 1.01 * (error + (len(certificate["system"]["inputs"]) + 2) * _UNIT * size) + _TINY


def _look(certificate: Any, look: Look, of_signals: list[tuple[Real, Real]]) -> Rounded:
    error = sum((ratio(w) * e for w, (e, _) in zip(look.gross, of_signals, strict=True)), ZERO)
    size = sum((ratio(w) * z for w, (_, z) in zip(look.gross, of_signals, strict=True)), ratio(look.gross_offset))
    roundings = 5 + _terms(certificate) + max(len(certificate["system"][side]) for side in ("states", "inputs"))
    tiny = _TINY * (1 + ratio(exact_sum(iter(look.gross))))
    return Rounded(SIGN * size, 1.01 * (error + roundings * _UNIT * size) + tiny)


def _within(certificate: Any, i: int, exact: Real) -> Real:
    """The part of an interval that the bounds of the i-th state by itself leave."""
    low, high = exact.a, exact.b
    for bound in certificate["bounds"]:
        row = bound["row"]
        if bound["of"] == "state" and row[i] and not any(r for k, r in enumerate(row) if k != i):
            ends = [iv.mpf(bound[end]) / iv.mpf(row[i]) for end in ("lower", "upper")]
            if row[i] < 0:
                ends.reverse()
            low = ends[0].a if ends[0].a > low else low
            high = ends[1].b if ends[1].b < high else high
    return iv.mpf([low, high]) if low <= high else exact


def _terms(certificate: Any) -> int:
    """How many looks at signals an input takes together."""
    return 2 if is_nonlinear(certificate) else sum(map(len, functionals(certificate, "inputs")[0]["weights"]))


def _longest(certificate: Any) -> int:
    """How many looks at one signal an input takes."""
    if is_nonlinear(certificate):
        return 2
    return max(len(w) for part in functionals(certificate, "inputs") for w in part["weights"])


def _signal_error(certificate: Any, signal: Any) -> tuple[Real, Real]:
    """Over-estimates of |float64 − exact| and of |z| at all times |t| ≤ until, and the few steps beyond."""
    u, longest = iv.mpf(2) ** -53, _longest(certificate)
    latest = iv.mpf(max(map(abs, signal["centres"])))
    farthest = certificate["evaluation"]["until"] + longest * iv.mpf(certificate["system"]["sampling_time"]) + latest

    def leaf(kind: str, *hyperparameters: Real) -> tuple[Real, ...]:
        """Bounds of |κ|, |κ̇|, |r κ̇| and |r κ|, and of the roundings in κ's own formula in units of u."""
        alone = {"type": kind, **dict(zip(KERNELS[kind], hyperparameters, strict=True))}
        size, slope = beyond(alone, ZERO)
        own = 30 + 6 * hyperparameters[2] if kind == "RationalQuadratic" else 30
        # x e^(−x²/2) ≤ 0.607; of x = √3 r/θ₂ or √5 r/θ₂: x (1 + x) e^(−x) ≤ 0.841, x (1 + x + x²/3) e^(−x) ≤ 1.176
        reached = {"SquaredExponential": 0.607, "Matern32": 0.841 / 1.732, "Matern52": 1.176 / 2.236}
        moment = size * hyperparameters[1] * reached[kind] if kind in reached else farthest * size
        return size, slope, farthest * slope if kind == "Periodic" else size, moment, own * size

    def add(f: tuple[Real, ...], g: tuple[Real, ...]) -> tuple[Real, ...]:
        return *(x + y for x, y in zip(f[:4], g[:4], strict=True)), f[4] + g[4] + f[0] + g[0]

    def multiply(f: tuple[Real, ...], g: tuple[Real, ...]) -> tuple[Real, ...]:
        # |r κ̇| of a product: of what does not decay only the part that the other factor leaves
        stretch = _lesser(f[2] * g[0], f[1] * g[3]) + _lesser(f[0] * g[2], f[3] * g[1])
        moment, own = _lesser(f[3] * g[0], f[0] * g[3]), (f[4] + f[0]) * g[0] + f[0] * g[4]
        return f[0] * g[0], f[1] * g[0] + f[0] * g[1], stretch, moment, own

    size, slope, stretch, _, own = fold(signal["kernel"], leaf, add, multiply)
    # Rounded once each: k T, t + j T, t − t_i; up to six times the argument of κ; n + 2 times the dot product.
    each = own + 9 * stretch + 3 * latest * slope + (len(signal["weights"]) + 3) * size
    weight = sum((abs(c) for _, c in pairs(signal)), ZERO)
    largest = abs(iv.mpf(signal["mean"])) + weight * size
    return u * (weight * each + 3 * largest), largest


def _lesser(x: Real, y: Real) -> Real:
    """Both bound the same number from above."""
    return x if x.b <= y.b else y
