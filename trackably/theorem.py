"""Write certificates as files for Coq: a theorem, and its proof by the verified checker in the folder `theorem/`."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from fractions import Fraction
from hashlib import sha256
from pathlib import Path

from trackably.checker import certificate as proofs
from trackably.checker import counterexample as refutations
from trackably.checker.certificate import AllPhases, AllTimes, Certificate, Claim, Steps, Window
from trackably.checker.counterexample import Counterexample, read_counterexample
from trackably.checker.disturbances import Hull, Robust, Zonotope
from trackably.checker.form import UnreadableError, format_of, read_certificate
from trackably.checker.kernels import Kernel
from trackably.checker.subject import Functional, LinearSystem, Row, Signal
from trackably.checking import read
from trackably.errors import InputError

KERNELS = ("SquaredExponential", "Periodic", "Matern32", "Matern52", "Sum", "Product")
"""Kernels that `theorem/Checker.v` covers; its constructors have the names of the classes here."""

_HEADER = """(* What a check of the certificate names as its reference has the SHA-256
   {}. *)
From Coq Require Import QArith List.
From Trackably Require Import Statement Checker.
Import ListNotations.
Open Scope Q_scope.
"""

_REFERENCE = """Definition reference : certificate := {{|
  signals := {signals};
  sampling_time := {sampling_time};
  system := {system};
  states := {states};
  inputs := {inputs};
  state_set := {state_set};
  input_set := {input_set};
  times := {times} |}}.
"""

_DISTURBED = """Definition disturbed : disturbance := {{|
  feedback := {feedback};
  pushes := {pushes};
  noise := {noise};
  all_states := {state_set};
  all_inputs := {input_set} |}}.
"""

_TUBE = """check_tube_sound _ _
    {{| {0}.head := {head}; {0}.more := {more}; {0}.contraction := {contraction}; {0}.box := {box} |}} trackable"""

_ROUNDING = 1 + Fraction(1, 2**30)
"""The box P around the disturbances and its contraction (`checker.disturbances`) are made larger by this factor,
because Coq's intervals round outwards. In return, more powers of A + B K are summed one by one, so that the set of
errors does not become larger than the certificate's."""

_COVER = "check_sound _ {{| {0}.degree := 10; {0}.halvings := 40; {0}.cuts := 14; {0}.by_ := {0}.{1} |}}"
"""Coq's checker encloses signals by polynomials of degree 10 about the middle of each box, an interval of time. It may
halve boxes 40 times, far more often than is needed."""

SILENT = """It says nothing about evaluation in float64, distances from true signals, plants that differ from their
model, or disturbances from the hull of given points. That its numbers are those of the certificate is not proved, but
can be read."""


@dataclass(frozen=True)
class Part:
    """A definition, a theorem with its `name` and what it `says`, and the `lemma` that proves it by computation.

    All of these are texts for Coq.
    """

    definition: str
    name: str
    says: str
    lemma: str

    @property
    def statement(self) -> str:
        return f"{self.definition}\nTheorem {self.name} : {self.says}.\n"

    def __str__(self) -> str:
        return f"{self.statement}Proof.\n  apply ({self.lemma}).\n  vm_cast_no_check (eq_refl true).\nQed.\n"


@dataclass(frozen=True)
class Theorem:
    """The theorems of a certificate or counterexample for Coq.

    `reference` is the SHA-256 of the reference, as a check of the file prints it.
    """

    reference: str
    parts: tuple[Part, ...]

    @property
    def text(self) -> str:
        """The file for Coq: definitions, theorems and proofs."""
        return "\n".join((_HEADER.format(self.reference), *map(str, self.parts)))

    @property
    def statement(self) -> str:
        """The definitions of system, signals, sets and claim, and the theorems about them, without proofs."""
        return "\n".join(part.statement for part in self.parts)

    @property
    def fingerprint(self) -> str:
        """The SHA-256 of the statement. What its words mean is in `theorem/Statement.v`."""
        return sha256(self.statement.encode()).hexdigest()


def theorem(file: Path, emulated: bool = False) -> Theorem:
    """State the content of a certificate as a theorem for Coq, with a proof; the text `SILENT` says what it leaves out.

    For a counterexample, state that the reference is not trackable. `emulated` floating-point numbers are made of
    integers: proofs are slower, but need not trust the processor's arithmetic. InputError: the file is of another kind,
    or Coq's checker does not cover its content.
    """
    content = read(file)
    kind = format_of(content)
    arithmetic = "Emulated" if emulated else "Native"
    try:
        if isinstance(content, dict) and kind == proofs.FORMAT:
            return _theorem(read_certificate(content), arithmetic)
        if isinstance(content, dict) and kind == refutations.FORMAT:
            return _theorem(read_counterexample(content), arithmetic)
        if kind and kind.startswith("trackably "):
            raise UnreadableError(f"Coq covers certificates and counterexamples of references, but this is a {kind!r}")
        raise UnreadableError(f"is not a certificate: certificate.format must be {proofs.FORMAT!r}, got {kind!r}")
    except UnreadableError as error:
        raise InputError(f"{file}: {error}") from error


def _theorem(about: Certificate | Counterexample, arithmetic: str) -> Theorem:
    subject = about.subject
    system, trajectories = subject.system, subject.trajectories
    if not isinstance(system, LinearSystem) or trajectories is None or subject.pieces or subject.attainable:
        other = "polynomial pieces" if subject.pieces else "redundant inputs" if subject.attainable else "formulas"
        raise UnreadableError(
            f"Coq covers linear systems without redundant inputs whose signals are sums of kernels, not {other}"
        )
    robust = about.robust if isinstance(about, Certificate) else None
    sets = (subject.state_set, subject.input_set, *((robust.state_set, robust.input_set) if robust else ()))
    if any(row.moves for bounded in sets for row in bounded.rows):
        raise UnreadableError("Coq covers constant bounds only, but a bound in this file moves in time")
    equations = (
        f"{{| of_states := {_numbers(a)}; of_inputs := {_numbers(b)}; constant := {_number(c)} |}}"
        for a, b, c in zip(system.A, system.B, system.c, strict=True)
    )
    if isinstance(about, Certificate):
        times, cover = _claim(about)
        name, says, lemma = "trackable", "holds reference", _COVER.format(arithmetic, cover)
    else:
        times, lemma = _counterexample(about)
        name, says = "not_trackable", "~ holds reference"
    definition = _REFERENCE.format(
        signals=_list(map(_signal, subject.signals)),
        sampling_time=_number(system.sampling_time),
        system=_list(equations),
        states=_list(map(_trajectory, trajectories.states)),
        inputs=_list(map(_trajectory, trajectories.inputs)),
        state_set=_list(map(_bound, subject.state_set.rows)),
        input_set=_list(map(_bound, subject.input_set.rows)),
        times=times,
    )
    nominal = Part(definition, name, says, f"{arithmetic}.{lemma}")
    if robust is None or not isinstance(robust.set, Zonotope) or isinstance(robust.noise, Hull):
        return Theorem(subject.fingerprint, (nominal,))
    disturbed = _disturbance(robust, robust.set, robust.noise or Zonotope((), ()), arithmetic)
    return Theorem(subject.fingerprint, (nominal, disturbed))


def _disturbance(robust: Robust, disturbance: Zonotope, noise: Zonotope, arithmetic: str) -> Part:
    definition = _DISTURBED.format(
        feedback=_list(map(_numbers, robust.feedback)),
        pushes=_zonotope(disturbance),
        noise=_zonotope(noise),
        state_set=_list(map(_bound, robust.state_set.rows)),
        input_set=_list(map(_bound, robust.input_set.rows)),
    )
    tube = _TUBE.format(
        arithmetic,
        head=2 * robust.head + 8,
        more=robust.terms - 1,
        contraction=_number(Fraction(robust.contraction) * _ROUNDING),
        box=_numbers(Fraction(size) * _ROUNDING for size in robust.box),
    )
    return Part(definition, "trackable_though_disturbed", "withstands reference disturbed", f"{arithmetic}.{tube}")


def _zonotope(zonotope: Zonotope) -> str:
    return f"{{| middle := {_numbers(zonotope.centre)}; generators := {_list(map(_numbers, zonotope.generators))} |}}"


def _times(claim: Claim) -> str:
    match claim:
        case AllTimes():
            return "AllTimes"
        case AllPhases():
            return "AllPhases"
        case Window(start, end):
            return f"Window {_number(start)} {_number(end)}"
    return "Instants"


def _claim(certificate: Certificate) -> tuple[str, str]:
    """Return two Coq terms: the claimed times, and how the proof covers them."""
    claim, proof, how = certificate.claim, certificate.proof, "Whole"
    if isinstance(proof, Steps):
        how = f"Steps {proof.last}"
    elif not isinstance(claim, Window):
        how = f"{'Tail' if isinstance(claim, AllTimes) else 'Period'} {_number(proof.end)}"
    return _times(claim), how


def _counterexample(counterexample: Counterexample) -> tuple[str, str]:
    """Return the refuted claim's times as a Coq term, and the term that refutes it at one of them."""
    at, times = counterexample.at, _times(counterexample.claim)
    if times != "Instants":
        return times, f"refute_sound _ {_number(at)} 0"
    exactly = Fraction(at) * Fraction(counterexample.subject.system.sampling_time)
    return times, f"refute_sound _ {_number(exactly)} {at}"


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
    lower, upper = map(_number, row.ends)
    return f"{{| row := {_numbers(row.row)}; lower := Some {lower}; upper := Some {upper} |}}"


def _numbers(values: Iterable[float | Fraction]) -> str:
    return f"[{'; '.join(map(_number, values))}]"


def _number(value: float | Fraction) -> str:
    """Return exactly this number as a Coq rational; a float64's denominator is written as a power of two."""
    exact = Fraction(value)
    below = exact.denominator
    power = below.bit_length() - 1
    return f"({exact.numerator} # {f'2 ^ {power}' if power and below == 2**power else below})"


def _list(items: Iterable[str], between: str = "\n    ") -> str:
    return f"[{(';' + between).join(items)}]"
