"""Judge certificates: the checker imports nothing of what learns a reference and proposes its proof.

Theorem. A certificate holds signals z_s(t) = m_s + Σ_i c_si κ_s(t − t_si) with means m_s, weights c_si, centres t_si
and kernels κ_s; a linear system x⁺ = A x + B u + c with sampling time T; a state set X and an input set U, both of the
form {v : lower ≤ G v ≤ upper}; and, in rational numbers, vectors M_sj, N_sj (j = 0, 1, …), x₀ and u₀. Every stored
float64 stands for exactly one real number, its own value. Let
x(t) = x₀ + Σ_s Σ_j M_sj z_s(t + j T) and u(t) = u₀ + Σ_s Σ_j N_sj z_s(t + j T).
If `check` answers Proved, then x(t + T) = A x(t) + B u(t) + c, x(t) ∈ X and u(t) ∈ U for
  - all_times:  every real t ≥ 0;
  - all_phases: every real t;
  - window:     every real t from start to end;
  - instants:   every t = k T, k = 0, 1, 2, …
So the system follows the states x(k T) with the admissible inputs u(k T). Let E be the number `until` in the field
`evaluation` of the certificate. At all of these times that are float64 numbers with |t| ≤ E, the distance from each
bound exceeds the error of evaluating x(t), u(t) and the bound's row in float64. The same holds for times k T that are
rounded to float64, and for all_phases also if a time t or k T is first moved by whole periods, with an error of up to
2⁻⁵³ E, to a time with |t| ≤ E.

Proof. Every step is verified here, step 0 in rational arithmetic, the others in interval arithmetic (mpmath iv). Step
2, and R and D of step 3, are first computed in arrays of float64 intervals (the first pass, `floats`). The boxes that
these leave undecided are decided in mpmath; there, R and D are computed too if float64 has no finite ones.
  0. x₀ = A x₀ + B u₀ + c, and M_s(j−1) = A M_sj + B N_sj for all j ≥ 0, where M_s(−1) and all vectors after the last
     ones are zero (`trajectories`).
  1. Boxes without gaps cover [0, tail_start], one period, or the window (`boxes`).
  2. In each box, each bounded quantity, a weighted sum of shifted signals (`quantities`), is enclosed by a polynomial
     and a bound of the polynomial's error (`kernels` has the estimate). The polynomial stays further inside the limits
     of the quantity than this error and the errors of step 5 together. This is decided by Bernstein coefficients, whose
     convex hull contains the polynomial, for the whole box or for each of its subintervals.
  3. Let e = z − m, and let t₀ be `tail_start`, or the first instant after those checked one by one (`boxes`). Let
     K_i and D_i bound |κ(r)| and |κ̇(r)| at all distances r = t − t_i with t ≥ t₀. Then, for all t ≥ t₀, |e(t)| ≤ R =
     Σ |c_i| K_i and |ė(t)| ≤ D = Σ |c_i| D_i. So |Σ_j w_j e(t + j T)| is at most Σ_j |w_j| R. As the sum equals Σ_j
     w_j e(t) + Σ_j w_j (e(t + j T) − e(t)), it is also at most |Σ_j w_j| R + T Σ_j j |w_j| D (`tail`).
  4. If all elementary kernels have the same period, what holds for one period of t holds for all t (`boxes`).
  5. The rounding errors of evaluation are at most the errors that the certificate states (`rounding`).

Extensions. Each is a theorem with its proof, at the head of its module, and says what it adds:
  - `inverse`:        nonlinear systems x⁺ = f(x, u) that are solved for u;
  - `flatness`:       nonlinear systems whose states and inputs are formulas of shifted signals;
  - `piecewise`:      signals of polynomial pieces;
  - `redundancy`:     redundant inputs, of which several have the same effect;
  - `disturbances`:   disturbed systems with a feedback, and noise of the measured state;
  - `model_error`:    disturbed systems whose matrices lie in a convex hull;
  - `tables`:         states and inputs at steps, shown to keep bounds and dynamics, or to break them;
  - `counterexample`: a time at which a bound is broken;
  - `joints`:         trajectories of joints whose derivatives keep limits, or break them;
  - `contradiction`:  bounds and values that no reference satisfies;
  - `truth`:          how far states are from every signal that explains samples, or that no signal does.

Which reference. The answer names the SHA-256 of all that defines x(t) and u(t): the signals, the system with its flat
form, and M, N, x₀ and u₀ (`form.fingerprint` has the canonical form). Certificates and counterexamples with the same
SHA-256 speak about the same system, x(t) and u(t). The SHA-256 does not depend on the sets, the claim, and K, W and V
of `disturbances`, all of which the answer states, nor on v(t) of `redundancy`, of which only the existence is proved.

Assumptions about rounding. Arithmetic is IEEE's, with subnormal numbers. exp, log, sqrt, sin, cos, atan, atan2 and
powers are within 4 units in the last place. The evaluated formulas are those of κ in `kernels`, sums of products in any
order (no fast Fourier transforms), and for nonlinear systems the formulas of u, or those of the flat form. The first
pass, which also computes the six digits that are printed of x(0), assumes the same of NumPy's arithmetic, exp, log,
sqrt, cos, arctan and arctan2. It is left out if the check is `exact`, or is that of a counterexample, of polynomial
pieces or of joints, if NumPy is missing, or if the processor replaces subnormal numbers by zero. Then nothing but the
errors of evaluation rests on these assumptions. The answer says which arithmetic it trusted.

Limits. Files are read up to 32 MB, with up to 100 signals, states and inputs, 100 shifts and 500,000 centres of a
signal, 10,000 rows of a set, 500,000 boxes of a bound or instants, named steps up to 9,007,199,254,740,992, 64 Taylor
terms, 10,000 powers of A + B K, rational numbers of 4,000 characters, texts of 500,000 characters together, 1,000,000
weights of shifted signals in all bounds together, 100 coefficients of a piece, 100 kernels combined in one, nested 40
deep, and 30,000 numbers, names and operations of all formulas together, nested 100 deep; the formula of an input has up
to 10,000 of these. Polynomials of flat forms have up to 5000 terms, with 80 values of functions. A file that exceeds a
limit is refused (`limits`). A check is Undecided if it would need a rational number of more than 500,000 bits, whole
numbers of more than 1,000,000,000 bits together, more than 500,000 breakpoints of pieces in one bound, or 700 MB of
memory beyond what the process has held before (if the system tells). A check that is given a time limit is Undecided
after this time.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from trackably.checker.answers import (
    Contradicted,
    Failed,
    FailedStepError,
    NotACertificate,
    Proved,
    Refuted,
    Undecided,
    Verdict,
)
from trackably.checker.boxes import NO_FIRST_PASS, FirstPass, check_boxes, check_cover
from trackably.checker.certificate import FORMAT, Certificate
from trackably.checker.contradiction import FORMAT as CONTRADICTION
from trackably.checker.contradiction import check_contradiction, impossibility, read_contradiction
from trackably.checker.counterexample import FORMAT as COUNTEREXAMPLE
from trackably.checker.counterexample import check_counterexample, read_counterexample
from trackably.checker.disturbances import check_robust
from trackably.checker.form import (
    UnreadableError,
    format_of,
    has_pieces,
    read_certificate,
    require_short_texts,
    short,
)
from trackably.checker.inverse import UnsolvableError
from trackably.checker.joints import BROKEN as BROKEN_JOINTS
from trackably.checker.joints import FORMAT as JOINTS
from trackably.checker.joints import (
    check_broken,
    check_joints,
    joints_refutation,
    joints_statement,
    read_broken_joints,
    read_joints,
)
from trackably.checker.piecewise import check_pieces
from trackably.checker.quantities import quantities
from trackably.checker.redundancy import check_input_set
from trackably.checker.rounding import check_rounding, check_sizes
from trackably.checker.statement import no_signal, refutation, statement, table_refutation, table_statement
from trackably.checker.tables import FORMAT as TABLE
from trackably.checker.tables import REFUTED as REFUTED_TABLE
from trackably.checker.tables import check_refuted_table, check_table, read_refuted_table, read_table
from trackably.checker.tail import check_tail
from trackably.checker.trajectories import check_names, check_shapes, check_trajectories
from trackably.checker.truth import CONTRADICTION as CONTRADICTED
from trackably.checker.truth import check_truth, contradiction_of, read_contradicted
from trackably.checker.watch import Report, UndecidedError, watch

__all__ = ["Contradicted", "Failed", "NotACertificate", "Proved", "Refuted", "Undecided", "Verdict", "check"]


def check(data: object, seconds: float | None = None, report: Report | None = None, exact: bool = False) -> Verdict:
    """Verify the content of a certificate, counterexample, table, trajectory or contradiction, as decoded from JSON.

    A check that takes longer than `seconds` answers Undecided; None sets no limit. The progress of the check is
    reported by calls of `report(done, total)`. An `exact` check does not use float64 intervals.
    """
    try:
        with watch(seconds, report):
            return _check(data, exact)
    except UndecidedError as error:
        return Undecided(str(error))
    except MemoryError:
        return Undecided("not decided: there is not enough memory")


def _check(data: object, exact: bool) -> Verdict:
    try:
        require_short_texts(data)
        if isinstance(data, dict):
            kind, reference = format_of(data), data.get("reference")
            exact = exact or (isinstance(reference, dict) and has_pieces(reference.get("signals")))
            first_pass = _first_pass(exact) if kind == FORMAT else NO_FIRST_PASS
            if kind in (kinds := _kinds(first_pass)):
                wanted, name, read, require, say = kinds[kind]
                found = read(data)
                try:
                    require(found)
                except UnsolvableError as error:
                    return Failed(f"system: {error}", name)
                except FailedStepError as error:
                    return Failed(str(error), name, error.bound)
                return wanted(f"{say(found)} {first_pass.trusted}")
    except UnreadableError as error:
        return NotACertificate(str(error))
    found = data.get("format") if isinstance(data, dict) else data
    expected = f"certificate.format must be {FORMAT!r} or the format of another proof"
    return NotACertificate(f"is not a certificate: {expected}, got {short(found)}")


_Shown = type[Proved | Refuted | Contradicted]
_Kind = tuple[_Shown, str, Callable[[Any], Any], Callable[[Any], object], Callable[[Any], str]]


def _kinds(first_pass: FirstPass) -> dict[str | None, _Kind]:
    """Return, for each format of files, what a check of such a file needs.

    This is the class of the answer to a valid file, the name of such files in sentences, and three functions. The first
    one reads the file, the second one raises FailedStepError unless the file is valid, and the third one says what a
    valid file shows.
    """
    whole = partial(check_certificate, first_pass=first_pass), partial(statement, first_pass=first_pass)
    return {
        FORMAT: (Proved, "certificate", read_certificate, *whole),
        COUNTEREXAMPLE: (Refuted, "counterexample", read_counterexample, check_counterexample, refutation),
        CONTRADICTED: (Contradicted, "contradiction", read_contradicted, contradiction_of, no_signal),
        CONTRADICTION: (Contradicted, "contradiction", read_contradiction, check_contradiction, impossibility),
        TABLE: (Proved, "certificate", read_table, check_table, table_statement),
        REFUTED_TABLE: (Refuted, "counterexample", read_refuted_table, check_refuted_table, table_refutation),
        JOINTS: (Proved, "certificate", read_joints, check_joints, joints_statement),
        BROKEN_JOINTS: (Refuted, "counterexample", read_broken_joints, check_broken, joints_refutation),
    }


def check_certificate(certificate: Certificate, first_pass: FirstPass) -> None:
    """Take all steps of the proof in their order. Raise FailedStepError at the first one that does not hold.

    `first_pass` is the check in float64 intervals; what it leaves undecided is checked in mpmath. Raise
    UnsolvableError if a nonlinear system x⁺ = f(x, u) cannot be solved for u.
    """
    subject, robust = certificate.subject, certificate.robust
    check_shapes(subject)
    check_trajectories(subject)
    check_names(certificate)
    check_input_set(subject)
    check_cover(certificate)
    check_robust(subject, robust)
    check_truth(subject, certificate.truth, robust, first_pass)
    if subject.pieces:
        check_pieces(certificate)
        return
    bounded = quantities(subject, certificate.errors)
    check_sizes(certificate, bounded)
    check_rounding(certificate, bounded)
    check_boxes(certificate, bounded, first_pass)
    check_tail(certificate, bounded, first_pass)


def _first_pass(exact: bool) -> FirstPass:
    """Return the checks in float64 intervals that are done before the checks in mpmath.

    Return `NO_FIRST_PASS`, which decides nothing, if the check is `exact`, if NumPy is missing, or if the processor
    takes subnormal numbers for zero. NumPy is loaded here, because to load it takes longer than most checks.
    """
    if not exact:
        try:
            from trackably.checker.floats.boxes import FIRST_PASS  # noqa: PLC0415
        except ImportError:  # there is no NumPy
            return NO_FIRST_PASS
        if FIRST_PASS.is_sound():
            return FIRST_PASS
    return NO_FIRST_PASS
