"""A reference as a header in plain C99, for a controller without Python: no memory is allocated, no state is kept."""

import math
import re
from functools import partial
from pathlib import Path

from trackable.arguments import text
from trackable.certificates.claim import AtInstants
from trackable.control.angles import angles_of
from trackable.exports.c99.allocation import allocation_function
from trackable.exports.c99.coordinates import assigned, counts, plain_sum
from trackable.exports.c99.numerals import number
from trackable.exports.c99.precise import arithmetic, pieces_function, precise_sum
from trackable.exports.c99.signals import kernel_sum_function
from trackable.exports.proved import Proved
from trackable.files import path_of, write_text
from trackable.systems.reference import Reference

_DEMANDS = """\
// IEEE doubles that are rounded to nearest after each operation, and a C library with exp, log, sin, cos, atan2 and pow
// within 4 units in the last place: the bounds above cover this and no more. Fused multiplications round less often.
#if FLT_RADIX != 2 || DBL_MANT_DIG != 53 || FLT_EVAL_METHOD != 0 || defined(__FAST_MATH__)
#error "this reference is certified for IEEE double precision without fast-math"
#endif
"""


def write_header(proved: Proved, path: Path | str, name: str) -> Path:
    """Write a header; see `Conventions.to_c`."""
    write_text(file := path_of("to_c", path), header(proved, name))
    return file


def header(proved: Proved, name: str) -> str:
    """Return the text of a header whose names begin with `name`. Raises as `Conventions.to_c`."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", text("to_c: name", name)):
        raise ValueError(f"to_c: name must be an identifier in C, such as axis, got {name!r}")
    reference = proved.reference
    guard = f"TRACKABLE_{name.upper()}_H"
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
    first, last = proved.certificate.claim.span
    until = proved.certificate.evaluated_until
    ends = [f"t >= {number(first)} - tolerance"] if math.isfinite(first) else []
    ends += [f"t <= {number(last)} + tolerance"] if math.isfinite(last) else []
    refused = [
        f"const double tolerance = fabs(t) * {number(proved.certificate.time_tolerance)};",
        f"if (!({' && '.join([*ends, f'fabs(t) <= {number(until)}'])})) return 1;",
    ]
    if not ends:
        refused = refused[1:]
    step = number(proved.reference.plant.sampling_time)
    at_t, at_step, by_step = "t", "t", f"const double t = (double)k * {step};"
    if proved.reference.pieces:
        at_t, at_step = (
            f"({name}_time){{{{t}}, 1}}",
            f"{name}_plus_product(({name}_time){{{{0.0}}, 1}}, (double)k, {step})",
        )
    at, by = (_block([*refused, f"{name}_values({time}, x, u);", "return 0;"]) for time in (at_t, at_step))
    found = [f"static inline int {name}_at(double t, double *x, double *u)", *at]
    if isinstance(proved.certificate.claim, AtInstants):  # between instants nothing is proved
        found = []
    return [*found, f"static inline int {name}_step(long k, double *x, double *u)", by[0], f"    {by_step}", *by[1:]]


def _block(body: list[str]) -> list[str]:
    return ["{", *(f"    {line}" for line in body), "}", ""]
