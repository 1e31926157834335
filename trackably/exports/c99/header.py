"""A reference as a header in plain C99, for a controller without Python: no memory is allocated, no state is kept."""

import math
import re
from functools import partial
from pathlib import Path

from trackably.arguments import text
from trackably.certificates.certificate import Certificate
from trackably.certificates.claim import AtInstants
from trackably.control.angles import angles_of
from trackably.exports.c99.allocation import allocation_function
from trackably.exports.c99.coordinates import assigned, counts, plain_sum
from trackably.exports.c99.numerals import number
from trackably.exports.c99.precise import arithmetic, phase_function, pieces_function, precise_sum
from trackably.exports.c99.signals import kernel_sum_function
from trackably.exports.proved import Proved
from trackably.files import new_file, write_text
from trackably.systems.reference import Reference

_DEMANDS = """\
// IEEE doubles that are rounded to nearest after each operation, and a C library with exp, log, sin, cos, atan2 and pow
// within 4 units in the last place: the bounds above cover this and no more. Fused multiplications round less often.
#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || FLT_EVAL_METHOD != 0 || defined(__FAST_MATH__)
#error "this reference is certified for IEEE double precision without fast-math"
#endif
"""


def write_header(proved: Proved, path: Path | str, name: str) -> Path:
    """Write a header; see `Conventions.to_c`."""
    write_text(file := new_file("to_c", path), header(proved, name))
    return file


def header(proved: Proved, name: str) -> str:
    """Return the text of a header whose names begin with `name`. Raises as `Conventions.to_c`."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", text("to_c: name", name)):
        raise ValueError(f"to_c: name must be an identifier in C, such as axis, got {name!r}")
    reference = proved.reference
    guard = f"TRACKABLY_{name.upper()}_H"
    parts = [
        *_story(proved, name),
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
        "#include <float.h>",
        "#include <math.h>",
        "",
        *_DEMANDS.splitlines(),
        "",
        f"#define {name.upper()}_STATES {len(reference.plant.system.states)}",
        f"#define {name.upper()}_INPUTS {len(reference.plant.system.inputs)}",
        f"#define {name.upper()}_SAMPLING_TIME {number(reference.plant.sampling_time)}",
        "",
        *_signals(reference, name),
        *_values(reference, name),
        *_guarded(proved, name),
        f"#endif // {guard}",
    ]
    return "\n".join(parts) + "\n"


def _story(proved: Proved, name: str) -> list[str]:
    reference, certificate = proved.reference, proved.certificate
    system = reference.plant.system
    said = [
        f"A reference of {', '.join(system.states)} [x] and {', '.join(system.inputs)} [u].",
        *certificate.explanation.splitlines(),
        "",
        f"{name}_at(t, x, u) and {name}_step(k, x, u) return 0, and fill x and u at t [s] or at k T_s, where",
        "that is proved. Elsewhere they return 1 and leave x and u as they are.",
        *_at_ends(certificate),
        "The input u, held for one sampling time, takes x(t) to x(t + T_s).",
        "",
        "By how much values with bounds differ from exact ones at most, which keep the bounds with as much to spare:",
        *(f"  {quantity}: {error:.3g}" for quantity, error in certificate.evaluation_error.items()),
        "",
        *(f"x[{i}] {state}{_turning(reference, i)}" for i, state in enumerate(system.states)),
        *(f"u[{i}] {given}" for i, given in enumerate(system.inputs)),
    ]
    if isinstance(certificate.claim, AtInstants):
        said[said.index("") + 1] = f"{name}_step(k, x, u) returns 0, and fills x and u at k T_s, where"
        said[said.index("") + 2] = "that is proved. Elsewhere it returns 1 and leaves x and u as they are."
    return [f"// {line}".rstrip() for line in said]


def _at_ends(certificate: Certificate) -> list[str]:
    """Say which steps are answered though they are not proved, strictly: k T_s may be rounded over an end."""
    ends = [f"{end:.17g} s" for end in certificate.claim.span if math.isfinite(end) and end]
    if not ends or certificate.reference.pieces:
        return []
    return [
        f"A step counts as proved up to {certificate.time_tolerance:g} of its time outside of {' and '.join(ends)}."
    ]


def _turning(reference: Reference, state: int) -> str:
    return ", an angle in (-pi, pi]: add whole turns" if state in angles_of(reference.plant) else ""


def _signals(reference: Reference, name: str) -> list[str]:
    """Return the functions name_z0, … of the signals, of a double or of an exact time; and name_smallest."""
    found = arithmetic(name) if reference.pieces else []
    for c, pieces in enumerate(reference.pieces):
        found += pieces_function(pieces, name, f"{name}_z{c}")
    if not reference.pieces:
        for c, signal in enumerate(reference.kernel_sums):
            found += kernel_sum_function(signal, f"{name}_z{c}")
    if reference.period:
        found += phase_function(reference.period, name)
    allocation = reference.plant.allocation
    return [*found, *allocation_function(allocation, name)] if allocation else found


def _values(reference: Reference, name: str) -> list[str]:
    """Return the function that evaluates at every time, proved or not: only name_at and name_step may call it."""
    step, coordinates = number(reference.plant.sampling_time), reference.plant.coordinates
    needed = counts((*coordinates["state"], *coordinates["input"]), len(reference.signals))
    kind, ahead, written = "double", f"t + j * {step}", plain_sum
    if reference.pieces:
        kind, ahead = f"{name}_dd", f"{name}_plus_product(t, j, {step})"
        written = partial(precise_sum, prefix=name)
    body = [f"{kind} z{c}[{count}];" for c, count in enumerate(needed)]
    for c, count in enumerate(needed):
        body += [f"for (int j = 0; j < {count}; ++j)", f"    z{c}[j] = {name}_z{c}({ahead});"]
    for symbol, side in (("x", coordinates["state"]), ("u", coordinates["input"])):
        for i, coordinate in enumerate(side):
            body += assigned(coordinate, f"{symbol}[{i}]", written)
    if reference.plant.allocation is not None:
        body.append(f"{name}_smallest(u);")
    time = f"{name}_time" if reference.pieces else "double"
    return [f"static inline void {name}_values({time} t, double *x, double *u)", *_block(body)]


def _guarded(proved: Proved, name: str) -> list[str]:
    reference, certificate = proved.reference, proved.certificate
    step = number(reference.plant.sampling_time)
    at_t, at_step = "t", "t"
    if reference.pieces:
        at_t, at_step = (
            f"({name}_time){{{{t}}, 1}}",
            f"{name}_plus_product(({name}_time){{{{0.0}}, 1}}, (double)k, {step})",
        )
    elif reference.period:
        at_t, at_step = (
            f"{name}_phase(({name}_dd){{t, 0.0}})",
            f"{name}_phase({name}_two_product((double)k, {step}))",
        )
    at, by = (
        [*_refused(certificate, tolerance), f"{name}_values({time}, x, u);", "return 0;"]
        for time, tolerance in ((at_t, _tolerance_of_times(certificate)), (at_step, certificate.time_tolerance))
    )
    found = [f"static inline int {name}_at(double t, double *x, double *u)", *_block(at)]
    if isinstance(certificate.claim, AtInstants):  # between instants nothing is proved
        found = []
    by = [f"const double t = (double)k * {step};", *by]
    return [*found, f"static inline int {name}_step(long long k, double *x, double *u)", *_block(by)]


def _refused(certificate: Certificate, tolerance: float) -> list[str]:
    """Return the lines that refuse a time t outside of what is proved by more than `tolerance` |t|."""
    first, last = certificate.claim.span
    ends = [f"t >= {number(first)}{' - tolerance' * bool(tolerance)}"] if math.isfinite(first) else []
    ends += [f"t <= {number(last)}{' + tolerance' * bool(tolerance)}"] if math.isfinite(last) else []
    refused = f"if (!({' && '.join([*ends, f'fabs(t) <= {number(certificate.last_time)}'])})) return 1;"
    return [f"const double tolerance = fabs(t) * {number(tolerance)};", refused] if ends and tolerance else [refused]


def _tolerance_of_times(certificate: Certificate) -> float:
    """Return the tolerance of times that are no steps: of polynomial pieces, the proof goes on as far as this."""
    return certificate.time_tolerance if certificate.reference.pieces else 0.0


def _block(body: list[str]) -> list[str]:
    return ["{", *(f"    {line}" for line in body), "}", ""]
