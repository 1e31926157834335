"""An independent checker of certificates: it shares no code with what learns a reference and finds the proof.

Theorem. A certificate holds signals z_s(t) = m_s + Σ_i c_si κ_s(t − t_si), a system x⁺ = A x + B u + c with sampling
time T, and bounds lower ≤ r x ≤ upper or lower ≤ r u ≤ upper; every number is taken as the real number that its float64
is. It also holds, in rationals, M, N, x₀ and u₀: let x(t) = x₀ + Σ_s Σ_j M_sj z_s(t + j T) and u(t) = u₀ + Σ_s Σ_j
N_sj z_s(t + j T). If `check` answers Proved, then x(t + T) = A x(t) + B u(t) + c at all t, and all bounds hold for
  - all_times:  every real t ≥ 0;
  - all_phases: every real t;
  - window:     every real t from start to end;
  - instants:   every t = k T, k = 0, 1, 2, …;
at a distance from either bound (`evaluation`) that exceeds the error of evaluating x(t), u(t) and r x or r u in float64
at such times up to `until`. So the admissible inputs u(k T) make the system follow x(k T). About rounding it is assumed
that arithmetic is IEEE's, exp, sin and pow are within 4 units in the last place, and the formulas are those of κ below
and sums of products in any order.

Proof. Every step is verified here, in interval arithmetic (mpmath iv), the first in rational arithmetic:
  0. x₀ = A x₀ + B u₀ + c, and M_s(j−1) = A M_sj + B N_sj for all j, with zeros beyond the ends (`_check_trajectories`).
  1. Boxes without gaps cover [0, tail_start], one period, or the window (`_check_cover`).
  2. In a box with midpoint s and half width h < ρ let |κ(z − t_i)| ≤ M for complex |z − s| < ρ. By Cauchy's estimate
     n terms of κ's Taylor series about s miss no more than M (h/ρ)ⁿ/(1 − h/ρ). If a Matérn kernel has its kink in the
     box, its analytic branch on one side is continued to the other side: off by twice its odd powers, which are
     bounded likewise. A polynomial lies in the convex hull of its Bernstein coefficients, on the whole box or on each
     of its parts (`_check_boxes`).
  3. Let K_i and D_i bound |κ| and |κ̇| from the distance between t_i and the end of the cover on. From there on
     |z − m| ≤ R = Σ |c_i| K_i and |ż| ≤ D = Σ |c_i| D_i, so that Σ_j w_j (z(t + j T) − m) is no larger than
     |Σ_j w_j| R + T Σ_j j |w_j| D, and no larger than Σ_j |w_j| R (`_check_tail`).
  4. If all parts of κ have one and the same period, what holds for one period of t holds always (`_check_cover`).
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import comb
from typing import Any

from mpmath.ctx_iv import MPIntervalContext

iv = MPIntervalContext()
iv.prec = 160

Real = Any
"""An interval of mpmath that holds a real number."""

_ONE, _ZERO, _SIGN, _INFINITE = iv.mpf(1), iv.mpf(0), iv.mpf([-1, 1]), iv.mpf([0, "inf"])
_GUARD = _SIGN * iv.mpf(2) ** -130  # mpmath rounds its functions outwards; this covers what their last bits might miss
_MOST_CUTS = 500


@dataclass(frozen=True)
class Proved:
    """The certificate is valid; `statement` says in words what it proves."""

    statement: str


@dataclass(frozen=True)
class Failed:
    """It reads as a certificate but proves nothing; `reason` names the first step that fails."""

    reason: str


@dataclass(frozen=True)
class NotACertificate:
    """`reason` names the first part that is missing, unknown or of a wrong kind."""

    reason: str


Verdict = Proved | Failed | NotACertificate


def check(data: object) -> Verdict:
    """Verify the content of a certificate file: what its JSON says, as dicts, lists, strings and numbers."""
    try:
        certificate = _read(data, _CERTIFICATE, "certificate")
    except _UnreadableError as error:
        return NotACertificate(str(error))
    for step in (
        _check_shapes,
        _check_trajectories,
        _check_sizes,
        _check_rounding,
        _check_cover,
        _check_boxes,
        _check_instants,
        _check_tail,
    ):
        if reason := step(certificate):
            return Failed(reason)
    return Proved(_statement(certificate))


# ---- reading: exactly the fields there are; numbers finite and exact in float64; nothing converted


class _UnreadableError(ValueError):
    pass


def _read(value: object, shape: Any, where: str) -> Any:
    """A value of this shape: a dict of shapes (... stands for all names), a list of one, or a function that reads."""
    if isinstance(shape, dict) and set(shape) == {...}:
        if not isinstance(value, dict):
            raise _UnreadableError(f"{where} must be an object")
        return {_name(name, where): _read(inner, shape[...], f"{where}.{name}") for name, inner in value.items()}
    if isinstance(shape, dict):
        if not isinstance(value, dict) or set(value) != set(shape):
            raise _UnreadableError(f"{where} must be an object with exactly the fields {', '.join(shape)}")
        return {name: _read(value[name], inner, f"{where}.{name}") for name, inner in shape.items()}
    if isinstance(shape, list):
        if not isinstance(value, list) or not value:
            raise _UnreadableError(f"{where} must be a list, not empty")
        return [_read(item, shape[0], f"{where}[{i}]") for i, item in enumerate(value)]
    return shape(value, where)


def _real(value: object, where: str) -> float:
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not abs(value) < 2**1023
        or float(value) != value
    ):
        raise _UnreadableError(f"{where} must be a finite number, exact in float64")
    return float(value)


def _positive(value: object, where: str) -> float:
    if not _real(value, where) > 0:
        raise _UnreadableError(f"{where} must be positive")
    return _real(value, where)


def _whole(value: object, where: str) -> int:
    if type(value) is not int or not 0 < value <= 1_000_000:
        raise _UnreadableError(f"{where} must be a positive whole number, a million at most")
    return value


def _name(value: object, where: str) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= 200:
        raise _UnreadableError(f"{where} must be a name")
    return value


def _rational(value: object, where: str) -> Fraction:
    if not isinstance(value, str) or len(value) > 20_000 or not re.fullmatch(r"-?[0-9]+(/0*[1-9][0-9]*)?", value):
        raise _UnreadableError(f"{where} must be a rational number, as in -3/4")
    numerator, _, denominator = value.partition("/")
    return Fraction(_integer(numerator), _integer(denominator or "1"))


def _integer(digits: str) -> int:
    """Python limits how many decimal digits it reads at once."""
    sign, digits = (-1, digits[1:]) if digits.startswith("-") else (1, digits)
    value = 0
    for i in range(0, len(digits), 4000):
        value = value * 10 ** len(digits[i : i + 4000]) + int(digits[i : i + 4000])
    return sign * value


def _only(wanted: object) -> Callable[[object, str], object]:
    def read(value: object, where: str) -> object:
        if type(value) is not type(wanted) or value != wanted:
            raise _UnreadableError(f"{where} must be {wanted!r}")
        return value

    return read


def _one_of(tag: str, shapes: dict[str, dict[str, Any]]) -> Callable[[object, str], object]:
    def read(value: object, where: str) -> object:
        kind = value.get(tag) if isinstance(value, dict) else None
        if not isinstance(kind, str) or kind not in shapes:
            raise _UnreadableError(f"{where}.{tag} must be one of {', '.join(shapes)}")
        if where.count(".") > 40:
            raise _UnreadableError(f"{where} is nested too deeply")
        return _read(value, {tag: _only(kind), **shapes[kind]}, where)

    return read


_RADIAL = {"signal_std": _positive, "lengthscale": _positive}
_KERNELS: dict[str, dict[str, Any]] = {
    "SquaredExponential": _RADIAL,
    "Matern32": _RADIAL,
    "Matern52": _RADIAL,
    "RationalQuadratic": {**_RADIAL, "shape": _positive},
    "Periodic": {**_RADIAL, "period": _positive},
}
_kernel = _one_of("type", _KERNELS)
_KERNELS |= {"Sum": {"left": _kernel, "right": _kernel}, "Product": {"left": _kernel, "right": _kernel}}

_BOXES = {"ends": [_real], "radii": [_positive]}
_COVERS = {"covers": {...: _BOXES}, "terms": _whole}
_FUNCTIONAL = {"offset": _rational, "weights": [[_rational]]}
_BOUND = {"name": _name, "row": [_real], "lower": _real, "upper": _real}
_CERTIFICATE = {
    "format": _only("trackable certificate"),
    "version": _only(2),
    "signals": [{"kernel": _kernel, "mean": _real, "centres": [_real], "weights": [_real]}],
    "system": {
        "A": [[_real]],
        "B": [[_real]],
        "c": [_real],
        "states": [_name],
        "inputs": [_name],
        "sampling_time": _positive,
    },
    "trajectories": {"states": [_FUNCTIONAL], "inputs": [_FUNCTIONAL]},
    "bounds": [_one_of("of", {"state": _BOUND, "input": _BOUND})],
    "evaluation": {"until": _positive, "errors": {...: _positive}},
    "claim": _one_of(
        "kind",
        {
            "all_times": {"tail_start": _positive, **_COVERS},
            "all_phases": {"period": _positive, **_COVERS},
            "window": {"start": _real, "end": _real, **_COVERS},
            "instants": {"last_step": _whole},
        },
    ),
}


# ---- kernels: Taylor coefficients, size in the complex plane, bounds from a distance on


def _exp(x: Real) -> Real:
    """e^x; without a bound above e^(10⁶), and without one below e^(−10⁶): such numbers decide nothing."""
    if x.b > 1e6:
        return _INFINITE
    if x.a < -1e6:
        return iv.mpf([0, _exp(iv.mpf(max(x.b, iv.mpf(-1e6)))).b])
    return iv.exp(x) * (1 + _GUARD)


def _log(x: Real) -> Real:
    return iv.log(x) * (1 + _GUARD)


def _cos(x: Real) -> Real:
    return iv.cos(x) + _GUARD


def _sin(x: Real) -> Real:
    return iv.sin(x) + _GUARD


def _root(x: float) -> Real:
    return iv.sqrt(iv.mpf(x)) * (1 + _GUARD)


def _at_most(x: Real, y: Real) -> bool:
    """Whether x ≤ y for certain."""
    return bool(iv.mpf(x).b <= iv.mpf(y).a)


def _fold(kernel: Any, leaf: Callable[..., Any], add: Callable[..., Any], multiply: Callable[..., Any]) -> Any:
    """A property of a kernel from that of its elementary parts."""
    if kernel["type"] not in {"Sum", "Product"}:
        return leaf(kernel["type"], *(iv.mpf(kernel[name]) for name in _KERNELS[kernel["type"]]))
    left, right = (_fold(kernel[side], leaf, add, multiply) for side in ("left", "right"))
    return (add if kernel["type"] == "Sum" else multiply)(left, right)


def _exp_series(g: list[Real], n: int) -> list[Real]:
    """e^g: f' = g' f, coefficient by coefficient."""
    f, slope = [_exp(g[0])], [j * coefficient for j, coefficient in enumerate(g)]
    for k in range(1, n):
        f.append(sum((slope[j] * f[k - j] for j in range(1, min(k + 1, len(g)))), _ZERO) / k)
    return f


def _power_series(q: list[Real], a: Real, n: int) -> list[Real]:
    """q^a: q f' = a q' f, coefficient by coefficient."""
    f = [_exp(a * _log(q[0]))]
    for k in range(1, n):
        f.append(sum(((a * j - (k - j)) * q[j] * f[k - j] for j in range(1, min(k + 1, len(q)))), _ZERO) / (k * q[0]))
    return f


def _times(f: list[Real], g: list[Real], n: int) -> list[Real]:
    return [sum((f[j] * g[k - j] for j in range(max(0, k + 1 - len(g)), min(k + 1, len(f)))), _ZERO) for k in range(n)]


def _taylor(kernel: Any, r: Real, h: Real, n: int) -> list[Real]:
    """Coefficients in x of κ(r + h x); of a Matérn kernel's branch for positive differences."""

    def leaf(kind: str, std: Real, length: Real, last: Real = None) -> list[Real]:
        if kind == "SquaredExponential":  # exp(−r²/(2 θ₂²))
            p = 2 * length**2
            shape = _exp_series([-(r**2) / p, -2 * r * h / p, -(h**2) / p], n)
        elif kind == "RationalQuadratic":  # (1 + r²/(2 α θ₂²))^(−α)
            p = 2 * last * length**2
            shape = _power_series([1 + r**2 / p, 2 * r * h / p, h**2 / p], -last, n)
        elif kind == "Periodic":  # exp(−(2/θ₂²) sin²(π r/θ₃)) = exp((cos ωr − 1)/θ₂²)
            omega = 2 * iv.pi * (1 + _GUARD) / last
            cosine, sine = _cos(omega * r), _sin(omega * r)
            turn, scale = (cosine, -sine, -cosine, sine), [_ONE]
            for k in range(1, n):
                scale.append(scale[-1] * omega * h / k)
            g = [turn[k % 4] * scale[k] / length**2 for k in range(n)]
            shape = _exp_series([g[0] - 1 / length**2, *g[1:]], n)
        else:  # (1 + x) e^(−x) with x = √3 r/θ₂, or (1 + x + x²/3) e^(−x) with x = √5 r/θ₂
            rate = _root(3 if kind == "Matern32" else 5) / length
            x, y = rate * r, rate * h
            factor = [1 + x, y] if kind == "Matern32" else [1 + x + x**2 / 3, y + 2 * x * y / 3, y**2 / 3]
            shape = _times(factor, _exp_series([-x, -y], n), n)
        return [std**2 * coefficient for coefficient in shape]

    def add(f: list[Real], g: list[Real]) -> list[Real]:
        return [x + y for x, y in zip(f, g, strict=True)]

    found: list[Real] = _fold(kernel, leaf, add, lambda f, g: _times(f, g, n))
    return found


def _largest_on_disc(kernel: Any, r: Real, radius: Real) -> Real:
    """Over-estimate of |κ(z)| on |z − r| < radius (of the branch as above): infinite if κ may be singular there.

    On the disc |Im z| ≤ radius, Re z² ≥ r²/2 − radius², and Re cos(x + iy) = cos x cosh y.
    """

    def leaf(kind: str, std: Real, length: Real, last: Real = None) -> Real:
        square = (r**2 / 2 - radius**2) / length**2
        if kind == "SquaredExponential":
            return std**2 * _exp(-square / 2)
        if kind == "RationalQuadratic":
            q = 1 + square / (2 * last)
            return std**2 * _exp(-last * _log(q)) if q.a > 0 else _INFINITE
        if kind == "Periodic":
            omega = 2 * iv.pi * (1 + _GUARD) / last
            cosine, reach = iv.mpf(_cos(omega * (r + radius * _SIGN)).b), omega * radius
            largest = cosine * (_exp(reach) + _exp(-reach)) / 2 if cosine > 0 else cosine
            return std**2 * _exp((largest - 1) / length**2)
        rate = _root(3 if kind == "Matern32" else 5) / length
        x = rate * (abs(r) + radius)
        return std**2 * (1 + x + (x**2 / 3 if kind == "Matern52" else 0)) * _exp(rate * (radius - abs(r)))

    return _fold(kernel, leaf, lambda f, g: f + g, lambda f, g: f * g)


def _beyond(kernel: Any, distance: Real) -> tuple[Real, Real]:
    """Over-estimates of |κ| and |κ̇| at all |r| ≥ distance ≥ 0. Of radial kernels |κ̇| rises up to ζ, and falls then."""

    def leaf(kind: str, std: Real, length: Real, last: Real = None) -> tuple[Real, Real]:
        if kind == "Periodic":  # |sin v| e^((cos v − 1)/θ₂²)/θ₂² ≤ e^(−1/2)/θ₂
            return std**2, std**2 * 2 * iv.pi * (1 + _GUARD) / last * _exp(iv.mpf(-0.5)) / length
        factors = {
            "SquaredExponential": lambda: _ONE,
            "Matern32": lambda: 1 / _root(3),
            "Matern52": lambda: (1 + _root(5)) / (2 * _root(5)),
            "RationalQuadratic": lambda: iv.sqrt(2 * last / (2 * last + 1)) * (1 + _GUARD),
        }
        zeta = length * factors[kind]()
        alone = {"type": kind, "signal_std": std, "lengthscale": length, "shape": last}
        steepest = iv.mpf([max(zeta.a, distance.a), max(zeta.b, distance.b)])
        return abs(_taylor(alone, distance, _ZERO, 1)[0]), abs(_taylor(alone, steepest, _ONE, 2)[1])

    found: tuple[Real, Real] = _fold(
        kernel, leaf, lambda f, g: (f[0] + g[0], f[1] + g[1]), lambda f, g: (f[0] * g[0], f[1] * g[0] + f[0] * g[1])
    )
    return found


def _parts(kernel: Any) -> Iterator[Any]:
    if kernel["type"] in {"Sum", "Product"}:
        yield from (part for side in ("left", "right") for part in _parts(kernel[side]))
    else:
        yield kernel


# ---- the steps of the proof: each says what is wrong, or None


@dataclass(frozen=True)
class _Quantity:
    """q(t) = offset + Σ_s Σ_j w_sj (z_s(t + j T) − m_s) with `weights[s][j]` = w_sj; offset is its value at rest.

    `gross[s]` and `gross_offset` are what the sizes of w_s and of the constants add up to if nothing cancels.
    [lower, upper] are the certificate's bounds, drawn in by its evaluation error.
    """

    name: str
    weights: list[list[Fraction]]
    offset: Real
    gross: list[Fraction]
    gross_offset: Fraction
    lower: Real
    upper: Real


def _ratio(number: Fraction) -> Real:
    return iv.mpf(number.numerator) / iv.mpf(number.denominator)


def _sum(numbers: Iterator[Fraction]) -> Fraction:
    return sum(numbers, Fraction(0))


def _quantities(certificate: Any) -> list[_Quantity]:
    return [_quantity(certificate, bound) for bound in certificate["bounds"]]


def _quantity(certificate: Any, bound: Any) -> _Quantity:
    row, parts = [Fraction(r) for r in bound["row"]], certificate["trajectories"][f"{bound['of']}s"]
    looks = [len(weights) for weights in parts[0]["weights"]]
    weights = [
        [_sum(r * part["weights"][s][j] for r, part in zip(row, parts, strict=True)) for j in range(count)]
        for s, count in enumerate(looks)
    ]
    gross = [
        _sum(abs(r * w) for r, part in zip(row, parts, strict=True) for w in part["weights"][s])
        for s in range(len(looks))
    ]
    at_rest = _sum(r * part["offset"] for r, part in zip(row, parts, strict=True)) + _sum(
        w * Fraction(signal["mean"])
        for signal, of_signal in zip(certificate["signals"], weights, strict=True)
        for w in of_signal
    )
    away = iv.mpf(certificate["evaluation"]["errors"][bound["name"]])
    return _Quantity(
        bound["name"],
        weights,
        _ratio(at_rest),
        gross,
        _sum(abs(r * part["offset"]) for r, part in zip(row, parts, strict=True)),
        iv.mpf(bound["lower"]) + away,
        iv.mpf(bound["upper"]) - away,
    )


def _summands(certificate: Any, q: _Quantity) -> Iterator[tuple[Any, Real, Real, Real]]:
    """All w c κ(t + s − t_i) of a quantity: the kernel, w c, s and t_i."""
    step = iv.mpf(certificate["system"]["sampling_time"])
    for signal, weights in zip(certificate["signals"], q.weights, strict=True):
        for j, w in enumerate(weights):
            for t, c in _pairs(signal) if w else ():
                yield signal["kernel"], _ratio(w) * c, j * step, t


def _pairs(signal: Any) -> list[tuple[Real, Real]]:
    return [(iv.mpf(t), iv.mpf(c)) for t, c in zip(signal["centres"], signal["weights"], strict=True)]


def _check_shapes(certificate: Any) -> str | None:
    """Matrices, trajectories and bounds are those of one system, and names are the same everywhere."""
    system, trajectories, signals = certificate["system"], certificate["trajectories"], certificate["signals"]
    n, m = len(trajectories["states"]), len(trajectories["inputs"])
    if any(len(signal["centres"]) != len(signal["weights"]) for signal in signals):
        return "signals: there must be as many centres as weights"
    if (
        [len(row) for row in system["A"]] != [n] * n
        or [len(row) for row in system["B"]] != [m] * n
        or [len(system[name]) for name in ("c", "states", "inputs")] != [n, n, m]
        or any(len(bound["row"]) != {"state": n, "input": m}[bound["of"]] for bound in certificate["bounds"])
    ):
        return "shapes: A, B, c, names, trajectories and bounds are not those of one system"
    for parts in trajectories.values():
        looks = [len(weights) for weights in parts[0]["weights"]]
        if len(looks) != len(signals) or any([len(w) for w in part["weights"]] != looks for part in parts):
            return "shapes: every state and every input needs weights of the same shape, for each signal"
    if not all(any(bound["row"]) for bound in certificate["bounds"]):
        return "shapes: a bound needs a row that is not all zero"
    coordinates = [*system["states"], *system["inputs"]]
    if len(set(coordinates)) != len(coordinates):
        return "names: states and inputs must have names of their own"
    names = [bound["name"] for bound in certificate["bounds"]]
    given = [certificate["evaluation"]["errors"], certificate["claim"].get("covers", names)]
    if len(set(names)) != len(names) or any(sorted(some) != sorted(names) for some in given):
        return "names: the bounds, the evaluation errors and the covers must have the same names, each once"
    return None


def _check_trajectories(certificate: Any) -> str | None:
    """x(t + T) = A x(t) + B u(t) + c whatever the signals are."""
    system, states, inputs = certificate["system"], *_sides(certificate)
    A, B = ([[Fraction(v) for v in row] for row in system[name]] for name in "AB")

    def follows(x: list[Fraction], u: list[Fraction], successor: list[Fraction], c: list[float]) -> bool:
        led = (_sum(a * v for a, v in zip(row, x, strict=True)) for row in A)
        pushed = (_sum(b * v for b, v in zip(row, u, strict=True)) for row in B)
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


def _sides(certificate: Any) -> tuple[Any, Any]:
    return certificate["trajectories"]["states"], certificate["trajectories"]["inputs"]


def _check_sizes(certificate: Any) -> str | None:
    """No number is so large, or so small, that float64 evaluation could overflow or lose a factor altogether."""
    numbers: list[float] = []
    positive: list[float] = [certificate["system"]["sampling_time"]]
    for signal in certificate["signals"]:
        numbers += [*signal["centres"], *signal["weights"], signal["mean"]]
        positive += [part[name] for part in _parts(signal["kernel"]) for name in _KERNELS[part["type"]]]
    factors = [size for q in _quantities(certificate) for size in (*q.gross, q.gross_offset) if size]
    positive += [float(min(max(factor, Fraction(1, 10**40)), Fraction(10**40))) for factor in factors]
    if max(map(abs, [*numbers, *positive])) > 1e30 or min(positive) < 1e-30:
        return "sizes: some number is too large or too small for the analysis of rounding"
    if certificate["evaluation"]["until"] > 1e60 or not all(
        _at_most(_beyond(signal["kernel"], _ZERO)[0], 1e100) for signal in certificate["signals"]
    ):
        return "sizes: some value could overflow in float64 evaluation"
    return None


def _check_rounding(certificate: Any) -> str | None:
    """The distances from the bounds exceed the errors of float64 evaluation: of first order in u, and a per cent."""
    evaluation, u = certificate["evaluation"], iv.mpf(2) ** -53
    of_signals = [_signal_error(certificate, signal) for signal in certificate["signals"]]
    trajectories = certificate["trajectories"]
    for q in _quantities(certificate):
        error = sum((_ratio(w) * e for w, (e, _) in zip(q.gross, of_signals, strict=True)), _ZERO)
        size = sum((_ratio(w) * z for w, (_, z) in zip(q.gross, of_signals, strict=True)), _ratio(q.gross_offset))
        roundings = 5 + sum(map(len, trajectories["inputs"][0]["weights"])) + max(map(len, trajectories.values()))
        tiny = iv.mpf(2) ** -300 * (1 + _ratio(_sum(iter(q.gross))))
        if not _at_most(1.01 * (error + roundings * u * size) + tiny, evaluation["errors"][q.name]):
            return f"evaluation: the {q.name} can be off by more than {evaluation['errors'][q.name]!r} in float64"
    return None


def _signal_error(certificate: Any, signal: Any) -> tuple[Real, Real]:
    """Over-estimates of |float64 − exact| and of |z| at all times |t| ≤ until, and the few steps beyond."""
    u, longest = (
        iv.mpf(2) ** -53,
        max(len(w) for part in certificate["trajectories"]["inputs"] for w in part["weights"]),
    )
    latest = iv.mpf(max(map(abs, signal["centres"])))
    farthest = certificate["evaluation"]["until"] + longest * iv.mpf(certificate["system"]["sampling_time"]) + latest

    def leaf(kind: str, *hyperparameters: Real) -> tuple[Real, ...]:
        """Bounds of |κ|, |κ̇| and |r κ̇|, and of the roundings in κ's own formula in units of u."""
        alone = {"type": kind, **dict(zip(_KERNELS[kind], hyperparameters, strict=True))}
        size, slope = _beyond(alone, _ZERO)
        own = 30 + 6 * hyperparameters[2] if kind == "RationalQuadratic" else 30
        return size, slope, farthest * slope if kind == "Periodic" else size, own * size

    def add(f: tuple[Real, ...], g: tuple[Real, ...]) -> tuple[Real, ...]:
        return f[0] + g[0], f[1] + g[1], f[2] + g[2], f[3] + g[3] + f[0] + g[0]

    def multiply(f: tuple[Real, ...], g: tuple[Real, ...]) -> tuple[Real, ...]:
        return f[0] * g[0], f[1] * g[0] + f[0] * g[1], f[2] * g[0] + f[0] * g[2], (f[3] + f[0]) * g[0] + f[0] * g[3]

    size, slope, stretch, own = _fold(signal["kernel"], leaf, add, multiply)
    # Rounded once each: k T, t + j T, t − t_i; up to six times the argument of κ; n + 2 times the dot product.
    each = own + 9 * stretch + 3 * latest * slope + (len(signal["weights"]) + 3) * size
    weight = sum((abs(c) for _, c in _pairs(signal)), _ZERO)
    largest = abs(iv.mpf(signal["mean"])) + weight * size
    return u * (weight * each + 3 * largest), largest


def _check_cover(certificate: Any) -> str | None:
    """Boxes without gaps cover what is claimed; what is claimed to be a period is one."""
    claim = certificate["claim"]
    if "covers" not in claim:
        return None
    start, end = claim.get("start", 0.0), claim.get("end", claim.get("tail_start", claim.get("period")))
    for signal in certificate["signals"] if claim["kind"] == "all_phases" else ():
        if any(part.get("period") != end for part in _parts(signal["kernel"])):
            return f"period: a kernel does not repeat after {end!r} s"
    for name, boxes in claim["covers"].items():
        ends = boxes["ends"]
        if (ends[0], ends[-1], len(ends)) != (start, end, len(boxes["radii"]) + 1):
            return f"cover: the boxes of the {name} must lead from {start!r} s to {end!r} s, with a radius for each"
        for before, after in pairwise(ends):
            if not before < after:
                return f"cover: the boxes of the {name} are out of order at {after!r} s"
    return None


def _check_boxes(certificate: Any) -> str | None:
    """In each box each quantity stays inside its bounds."""
    claim = certificate["claim"]
    for q in _quantities(certificate) if "covers" in claim else ():
        boxes = claim["covers"][q.name]
        for (start, end), radius in zip(pairwise(boxes["ends"]), boxes["radii"], strict=True):
            polynomial, missed = _enclose(certificate, q, start, end, radius)
            above = [polynomial[0] - q.lower - missed, *polynomial[1:]]
            below = [q.upper - polynomial[0] - missed, *(-coefficient for coefficient in polynomial[1:])]
            if not (_is_positive(above) and _is_positive(below)):
                return f"box: the {q.name} is not shown to stay inside its bounds from {start!r} s to {end!r} s"
    return None


def _enclose(certificate: Any, q: _Quantity, start: float, end: float, radius: float) -> tuple[list[Real], Real]:
    """Over the box as x ∈ [−1, 1]: coefficients of a polynomial in x, and a bound of its distance to the quantity."""
    n = min(certificate["claim"]["terms"], 64)
    first, last, rho = iv.mpf(start), iv.mpf(end), iv.mpf(radius)
    middle, h = (first + last) / 2, (last - first) / 2
    rest, polynomial, missed = _rest(h / rho, n), [q.offset] + [_ZERO] * (n - 1), _ZERO
    for kernel, weight, s, t in _summands(certificate, q):
        r = middle + s - t
        before, after = _at_most(last + s, t), _at_most(t, first + s)
        # κ is even: differences are mirrored to the positive side
        side = 1 if after or (not before and _at_most(0, r)) else -1
        shape = _taylor(kernel, side * r, side * h, n)
        polynomial = [x + weight * y for x, y in zip(polynomial, shape, strict=True)]
        missed += abs(weight) * _largest_on_disc(kernel, r, rho) * rest
        if not (before or after) and any("Matern" in part["type"] for part in _parts(kernel)):
            # r ≥ 0 is not certain right on the kink: then 1.01 h must still reach to the end of the box
            odd = _oddness(kernel, 1.01 * h, rho, n) if _at_most(-0.01 * h, side * r) else _INFINITE
            missed += abs(weight) * odd
    return polynomial, missed


def _rest(ratio: Real, n: int) -> Real:
    """Over-estimate of Σ_(k ≥ n) ratio^k."""
    return ratio**n / (1 - ratio) if ratio.b < 1 else _INFINITE


def _oddness(kernel: Any, reach: Real, radius: Real, n: int) -> Real:
    """Over-estimate of |κ₊(r) − κ₊(−r)| for 0 ≤ r ≤ reach, κ₊ the branch of positive differences."""
    odd = sum((abs(coefficient) for coefficient in _taylor(kernel, _ZERO, reach, n)[1::2]), _ZERO)
    return 2 * (odd + _largest_on_disc(kernel, _ZERO, radius) * _rest(reach / radius, n))


def _is_positive(a: list[Real]) -> bool:
    """Whether Σ a_k x^k ≥ 0 for x ∈ [−1, 1]: certain where the Bernstein coefficients in y = (x + 1)/2 are ≥ 0."""
    n = len(a) - 1
    p = [a[n]]
    for coefficient in reversed(a[:-1]):  # Horner: p ← (2y − 1) p + a_k
        p = [2 * x - y for x, y in zip([_ZERO, *p], [*p, _ZERO], strict=True)]
        p[0] += coefficient
    waiting = [[sum((p[j] * comb(k, j) / comb(n, j) for j in range(k + 1)), _ZERO) for k in range(n + 1)]]
    for _ in range(_MOST_CUTS):
        if not waiting:
            return True
        b = waiting.pop()
        if not (_at_most(0, b[0]) and _at_most(0, b[-1])):  # these two are values of the polynomial
            return False
        if all(_at_most(0, x) for x in b):
            continue
        left: list[Real] = []
        right: list[Real] = []
        while b:  # de Casteljau: the coefficients of both halves
            left, right = [*left, b[0]], [b[-1], *right]
            b = [(x + y) / 2 for x, y in pairwise(b)]
        waiting += [left, right]
    return False


def _check_instants(certificate: Any) -> str | None:
    """Each quantity stays inside its bounds at k T, k = 0 … last_step."""
    step, quantities = iv.mpf(certificate["system"]["sampling_time"]), _quantities(certificate)
    for k in range(certificate["claim"].get("last_step", -1) + 1):
        for q in quantities:
            value = q.offset
            for kernel, weight, s, t in _summands(certificate, q):
                value += weight * _taylor(kernel, abs(k * step + s - t), _ZERO, 1)[0]
            if not (_at_most(q.lower, value) and _at_most(value, q.upper)):
                return f"instants: the {q.name} is not shown to lie inside its bounds at step {k}"
    return None


def _check_tail(certificate: Any) -> str | None:
    """From the end of the cover, or the step after the last, each quantity stays inside its bounds for ever."""
    claim, step = certificate["claim"], iv.mpf(certificate["system"]["sampling_time"])
    if claim["kind"] not in {"all_times", "instants"}:
        return None
    start = iv.mpf(claim["tail_start"]) if claim["kind"] == "all_times" else (claim["last_step"] + 1) * step
    envelopes = [_envelope(signal, start) for signal in certificate["signals"]]
    for q in _quantities(certificate):
        reach = _ZERO
        for (size, rate), weights in zip(envelopes, q.weights, strict=True):
            by_size = _ratio(_sum(abs(w) for w in weights)) * size
            at_once = _ratio(abs(_sum(iter(weights)))) * size
            by_rate = at_once + step * _ratio(_sum(j * abs(w) for j, w in enumerate(weights))) * rate
            reach += by_size if _at_most(by_size, by_rate) else by_rate
        if not (_at_most(q.lower, q.offset - reach) and _at_most(q.offset + reach, q.upper)):
            return f"tail: the envelope of the {q.name} does not lie inside its bounds from {float(start.mid):g} s on"
    return None


def _envelope(signal: Any, start: Real) -> tuple[Real, Real]:
    """Over-estimates of |z − m| and |ż| from `start` on."""
    reach, rate = _ZERO, _ZERO
    for t, c in _pairs(signal):
        kappa, slope = _beyond(signal["kernel"], start - t if _at_most(t, start) else _ZERO)
        reach, rate = reach + abs(c) * kappa, rate + abs(c) * slope
    return reach, rate


def _statement(certificate: Any) -> str:
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
        f"For {times[claim['kind']]} the reference keeps {', '.join(held)}, and the system x⁺ = A x + B u + c with "
        f"A = {system['A']!r}, B = {system['B']!r}, c = {system['c']!r} follows it with these inputs "
        f"(T = {system['sampling_time']!r} s). The bounds hold with room for the error of float64 evaluation at times "
        f"up to {certificate['evaluation']['until']:g} s."
    )
