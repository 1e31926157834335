"""Certificates as files for Coq, which state and prove their theorem by the checker in the repository's `theorem/`."""

from collections.abc import Iterable
from dataclasses import fields
from fractions import Fraction
from math import isfinite
from pathlib import Path

from trackable.checker.certificate import FORMAT, AllPhases, AllTimes, Certificate, Instants, Window
from trackable.checker.kernels.base import Kernel
from trackable.checker.reading.certificates import read_certificate
from trackable.checker.reading.values import UnreadableError
from trackable.checker.subject import Functional, LinearSystem, Row, Signal
from trackable.checking import read
from trackable.errors import InputError

KERNELS = ("SquaredExponential", "Periodic", "Sum", "Product")
"""Kernels that `theorem/Checker.v` encloses: the names of the classes are those of Coq's constructors."""

DEGREE, HALVINGS, CUTS = 7, 40, 14

_FILE = """(* {name}: what its numbers state, and that they hold. Written by `python -m trackable theorem`.
   Signals and system have the SHA-256 {fingerprint}.
   Compile it with: coqc -Q theorem Trackable {stem}.v *)
From Coq Require Import QArith List.
From Trackable Require Import Statement Checker.
Import ListNotations.
Open Scope Q_scope.

Definition reference : certificate := {{|
  signals := {signals};
  sampling_time := {sampling_time};
  system := {system};
  states := {states};
  inputs := {inputs};
  state_set := {state_set};
  input_set := {input_set};
  times := {times} |}}.

Theorem trackable : holds reference.
Proof.
  apply (Native.check_sound _
    {{| Native.degree := {degree}; Native.halvings := {halvings}; Native.cuts := {cuts}; Native.by_ := {cover} |}}).
  vm_cast_no_check (eq_refl true).
Qed.

Print Assumptions trackable.
"""


SILENT = """It says nothing about evaluation in float64, nor about disturbances: the sets are those that the certificate's
reference keeps, drawn in where it is robust. That its numbers are those of the file is for you to trust, or to read."""


def theorem(certificate: Path) -> str:
    """Return a file for Coq that states and proves what a certificate holds; `SILENT` says what of it is left out.

    Raises InputError where the file is no certificate, or one that the checker in Coq does not cover.
    """
    content = read(certificate)
    try:
        if not (isinstance(content, dict) and content.get("format") == FORMAT):
            raise UnreadableError(f"is not a certificate: certificate.format must be {FORMAT!r}")
        return _written(certificate, read_certificate(content))
    except UnreadableError as error:
        raise InputError(f"{certificate}: {error}") from error


def _written(path: Path, certificate: Certificate) -> str:
    subject = certificate.subject
    system, trajectories = subject.system, subject.trajectories
    if not isinstance(system, LinearSystem) or trajectories is None or subject.pieces or subject.attainable:
        raise UnreadableError("Coq covers linear systems without redundant inputs whose signals are sums of kernels")
    equations = (
        f"{{| of_states := {_numbers(a)}; of_inputs := {_numbers(b)}; constant := {_number(c)} |}}"
        for a, b, c in zip(system.A, system.B, system.c, strict=True)
    )
    times, cover = _claim(certificate)
    return _FILE.format(
        name=path.name,
        stem=path.stem,
        fingerprint=subject.fingerprint,
        signals=_list(map(_signal, subject.signals)),
        sampling_time=_number(system.sampling_time),
        system=_list(equations),
        states=_list(map(_trajectory, trajectories.states)),
        inputs=_list(map(_trajectory, trajectories.inputs)),
        state_set=_list(map(_bound, subject.state_set.rows)),
        input_set=_list(map(_bound, subject.input_set.rows)),
        times=times,
        cover=cover,
        degree=DEGREE,
        halvings=HALVINGS,
        cuts=CUTS,
    )


def _claim(certificate: Certificate) -> tuple[str, str]:
    """Return the claim, and how it is to be proved."""
    match certificate.claim:
        case AllTimes(tail_start):
            return "AllTimes", f"Native.Tail {_number(tail_start)}"
        case AllPhases(period):
            return "AllPhases", f"Native.Period {_number(period)}"
        case Window(start, end):
            return f"Window {_number(start)} {_number(end)}", "Native.Whole"
        case Instants(last_step):
            return "Instants", f"Native.Steps {last_step}"


def _kernel(kernel: Kernel) -> str:
    name = type(kernel).__name__
    if name not in KERNELS:
        raise UnreadableError(f"Coq's checker has no kernel {name}; it has {', '.join(KERNELS)}")
    values = (getattr(kernel, field.name) for field in fields(kernel))  # type: ignore[arg-type]
    return f"({name} {' '.join(_kernel(v) if isinstance(v, Kernel) else _number(v) for v in values)})"


def _signal(signal: Signal) -> str:
    pairs = zip(signal.weights, signal.centres, strict=True)
    terms = _list((f"{{| weight := {_number(c)}; centre := {_number(t)} |}}" for c, t in pairs), "\n      ")
    return f"{{| prior := {_kernel(signal.kernel)}; mean := {_number(signal.mean)};\n    terms := {terms} |}}"


def _trajectory(functional: Functional) -> str:
    weights = _list(map(_numbers, functional.weights))
    return f"{{| offset := {_number(functional.offset)}; weights := {weights} |}}"


def _bound(row: Row) -> str:
    lower, upper = (f"Some {_number(v)}" if isfinite(v) else "None" for v in (row.lower, row.upper))
    return f"{{| row := {_numbers(row.row)}; lower := {lower}; upper := {upper} |}}"


def _numbers(values: Iterable[float | Fraction]) -> str:
    return f"[{'; '.join(map(_number, values))}]"


def _number(value: float | Fraction) -> str:
    """Return exactly this number, with a power of two where it is a float64's denominator."""
    exact = Fraction(value)
    below = exact.denominator
    power = below.bit_length() - 1
    return f"({exact.numerator} # {f'2 ^ {power}' if power and below == 2**power else below})"


def _list(items: Iterable[str], between: str = "\n    ") -> str:
    return f"[{(';' + between).join(items)}]"
