"""An independent checker of certificates: it shares no code with what learns a reference and finds the proof.

Theorem. A certificate holds signals z_s(t) = m_s + Σ_i c_si κ_s(t − t_si), a system with sampling time T, and bounds
lower ≤ r x ≤ upper or lower ≤ r u ≤ upper; every number is taken as the real number that its float64 is. The system is
  - linear, x⁺ = A x + B u + c. The certificate then also holds, in rationals, M, N, x₀ and u₀: let
    x(t) = x₀ + Σ_s Σ_j M_sj z_s(t + j T) and u(t) = u₀ + Σ_s Σ_j N_sj z_s(t + j T);
  - or nonlinear, x⁺ = f(x, u), with formulas f in nested lists and as many inputs as states and signals: let
    x_i(t) = z_i(t), and u(t) the only solution of f(x(t), u) = x(t + T), whose existence is part of what is proved.
If `check` answers Proved, then x(t + T) = A x(t) + B u(t) + c, or f(x(t), u(t)), and all bounds hold, for
  - all_times:  every real t ≥ 0;
  - all_phases: every real t;
  - window:     every real t from start to end;
  - instants:   every t = k T, k = 0, 1, 2, …;
at a distance from either bound (`evaluation`) that exceeds the error of evaluating x(t), u(t) and r x or r u in float64
at such times up to `until`. So the admissible inputs u(k T) make the system follow x(k T). If a certificate of a linear
system also holds an input_set U of rows lower ≤ r u ≤ upper, then some v(t) with B v(t) = 0 has u(t) + v(t) in U at all
these times, and these are the admissible inputs. About rounding it is assumed
that arithmetic is IEEE's, exp, log, sqrt, sin, cos and powers are within 4 units in the last place, and the formulas
are those of κ below, sums of products in any order, and for nonlinear systems those of u as found in step 0.

Proof. Every step is verified here, in interval arithmetic (mpmath iv), the first in rational arithmetic:
  0. Linear: x₀ = A x₀ + B u₀ + c, and M_s(j−1) = A M_sj + B N_sj for all j, with zeros beyond the ends. Nonlinear: each
     formula is split term by term into f0_i(x) + Σ_j G_ij(x) u_j, a sum or difference by its terms, a product or
     quotient by the one factor that holds inputs (not a denominator); f that is not affine in this way is refused. It
     is solved for u equation by equation as long as one holds a single unknown, u_j = (x⁺_i − f0_i − Σ known G u)/G_ij,
     and by Cramer's rule for the rest. Every part of f is in the formula of some u, and every u in some bound, so that
     where all bounded formulas are shown to be defined (arguments of log, sqrt and fractional powers positive, what is
     divided by not zero) f is defined, and u exists and is the only one (`system`, `affine`).
  1. Boxes without gaps cover [0, tail_start], one period, or the window (`boxes`).
  2. In a box with midpoint s and half width h < ρ let |κ(z − t_i)| ≤ M for complex |z − s| < ρ. By Cauchy's estimate
     n terms of κ's Taylor series about s miss no more than M (h/ρ)ⁿ/(1 − h/ρ). If a Matérn kernel has its kink in the
     box, its analytic branch on one side is continued to the other side: off by twice its odd powers, which are
     bounded likewise. Formulas of such polynomials are again polynomials, with a bound of what these miss (`models`).
     A polynomial lies in the convex hull of its Bernstein coefficients, on the whole box or on each of its parts.
  3. Let K_i and D_i bound |κ| and |κ̇| from the distance between t_i and the end of the cover on. From there on
     |z − m| ≤ R = Σ |c_i| K_i and |ż| ≤ D = Σ |c_i| D_i, so that Σ_j w_j (z(t + j T) − m) is no larger than
     |Σ_j w_j| R + T Σ_j j |w_j| D, and no larger than Σ_j |w_j| R. A formula differs from its value at rest by such a
     sum whose weights are its slopes at some point between, by the mean-value theorem (`tail`).
  4. If all parts of κ have one and the same period, what holds for one period of t holds always (`boxes`).
  5. Roundings add up to no more than the stated errors. Those of a nonlinear u are carried through its formula, with
     x(t) in its bounds, which the steps above have shown (`rounding`).
  6. Let the columns of Z span the kernel of B. There is a w with lower_i ≤ r_i (u + Z w) ≤ upper_i for all rows of U if
     Σ_i λ_i r_i u lies between Σ λ_i lower_i and Σ λ_i upper_i (ends exchanged where λ_i < 0) for all λ with
     Σ_i λ_i r_i Z = 0 (Farkas), hence if it does for those with least support: any λ is a sum of such without opposite
     signs. They are enumerated; for each a bound is found that says so (`redundancy`).
"""

from dataclasses import dataclass

from trackable.checker.affine import UnsolvableError
from trackable.checker.boxes import check_boxes, check_cover, check_instants
from trackable.checker.quantities import quantities
from trackable.checker.reading import UnreadableError
from trackable.checker.redundancy import check_input_set
from trackable.checker.rounding import check_rounding, check_sizes
from trackable.checker.shapes import read_certificate
from trackable.checker.statement import statement
from trackable.checker.system import check_shapes, check_trajectories
from trackable.checker.tail import check_tail


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
        certificate = read_certificate(data)
    except UnreadableError as error:
        return NotACertificate(str(error))
    for look in (check_shapes, check_trajectories, check_input_set, check_cover):
        if reason := look(certificate):
            return Failed(reason)
    try:
        bounded = quantities(certificate)
    except UnsolvableError as error:
        return Failed(f"system: {error}")
    for step in (check_sizes, check_rounding, check_boxes, check_instants, check_tail):
        if reason := step(certificate, bounded):
            return Failed(reason)
    return Proved(statement(certificate))
