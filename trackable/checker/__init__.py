"""Check certificates independently: the checker shares no code with what learns a reference and finds its proof.

Theorem. A certificate holds signals z_s(t) = m_s + Σ_i c_si κ_s(t − t_si), a system with sampling time T, a state set X
and an input set U, both of the form {v : lower ≤ R v ≤ upper}. Every number means exactly the real number that its
float64 is. The system is
  - linear, x⁺ = A x + B u + c. The certificate then also holds, in rational numbers, M, N, x₀ and u₀: let
    x(t) = x₀ + Σ_s Σ_j M_sj z_s(t + j T) and u(t) = u₀ + Σ_s Σ_j N_sj z_s(t + j T);
  - or nonlinear, x⁺ = f(x, u), with formulas f and as many inputs as states and signals: let x_i(t) = z_i(t), and let
    u(t) be the only solution of f(x(t), u) = x(t + T). That it exists and is the only one is part of what is proved.
If `check` answers Proved, then x(t + T) = A x(t) + B u(t) + c, or f(x(t), u(t)), and x(t) ∈ X and u(t) ∈ U, for
  - all_times:  every real t ≥ 0;
  - all_phases: every real t;
  - window:     every real t from start to end;
  - instants:   every t = k T, k = 0, 1, 2, …
So the system follows the states x(k T) with the admissible inputs u(k T). The distance from each bound exceeds the
error of evaluating x(t), u(t) and the bound's row in float64 at such times up to `until` (the field `evaluation`).

Redundant inputs. The certificate of a linear system may also hold `attainable` rows; these bound u(t) then, and not U.
If `check` answers Proved, then some v(t) with B v(t) = 0 has u(t) + v(t) ∈ U at all these times. The system follows
with these admissible inputs.

Assumptions about rounding. Arithmetic is IEEE's. exp, log, sqrt, sin, cos and powers are within 4 units in the last
place. The evaluated formulas are those of κ in `kernels`, sums of products in any order, and for nonlinear systems the
formulas of u found in step 0.

Proof. Every step is verified here, in interval arithmetic (mpmath iv); steps 0 and 6 in rational arithmetic.
  0. Linear: x₀ = A x₀ + B u₀ + c, and M_s(j−1) = A M_sj + B N_sj for all j, with zeros beyond the ends
     (`steps.trajectories`). Nonlinear: each formula is split into f0_i(x) + Σ_j G_ij(x) u_j. A sum or difference is
     split term by term; a product or quotient by the one factor that contains inputs, which is no denominator; other f
     are refused. The system is solved for u equation by equation as long as an equation has a single unknown,
     u_j = (x⁺_i − f0_i − Σ known G u)/G_ij, and by Cramer's rule for the rest (`formulas.affine`). Every part of f is
     in the formula of some input, and every input is in some bound. So where all bounded formulas are shown to be
     defined (arguments of log, sqrt and fractional powers are positive, divisors are not zero), f is defined, and u
     exists and is the only solution.
  1. Boxes without gaps cover [0, tail_start], one period, or the window (`steps.cover`).
  2. Consider a box with midpoint s and half width h < ρ, and let |κ(z − t_i)| ≤ M for complex |z − s| < ρ. By Cauchy's
     estimate n terms of κ's Taylor series about s miss no more than M (h/ρ)ⁿ/(1 − h/ρ). A kernel may have kinks, at a
     difference of 0 and where its support ends; between them it is analytic. The branch that holds in the middle of the
     box is continued over all of the box. At most two errors are added: beyond a kink at 0 that is in the box, twice
     the branch's odd powers, which are bounded likewise; and how far κ is from this branch beyond its other kinks, on
     the positive side (`jump`). κ is even, so that both together bound the error on the negative side. A box that
     contains 0, but whose middle is on another branch, is refused (`kernels.base`). Formulas of such polynomials are
     again polynomials, with a bound of what these miss (`arithmetic.models`). A polynomial lies in the convex hull of
     its Bernstein coefficients, on the whole box or on each of its parts (`arithmetic.polynomials`, `steps.boxes`).
  3. Let K_i and D_i bound |κ| and |κ̇| at all distances from t_i to times after the cover. Then, after the cover,
     |z − m| ≤ R = Σ |c_i| K_i and |ż| ≤ D = Σ |c_i| D_i. So |Σ_j w_j (z(t + j T) − m)| is at most
     |Σ_j w_j| R + T Σ_j j |w_j| D, and at most Σ_j |w_j| R. By the mean-value theorem, a formula differs from its
     value at rest by such a sum, whose weights are its slopes at some point between (`steps.tail`).
  4. If all parts of κ have the same period, what holds for one period of t holds for all t (`steps.cover`).
  5. Roundings add up to no more than the stated errors. Those of a nonlinear u are carried through its formula, with
     x(t) inside its bounds, as the steps above have shown (`steps.rounding`).
  6. Let the columns of Z span the kernel of B. By Farkas' lemma there is a w with lower_i ≤ r_i (u + Z w) ≤ upper_i for
     all rows of U if Σ_i λ_i r_i u lies between Σ_i λ_i lower_i and Σ_i λ_i upper_i (ends exchanged where λ_i < 0) for
     all λ with Σ_i λ_i r_i Z = 0. It is enough to know this for such λ of least support, because every other λ is a
     sum of these without opposite signs. They are enumerated, and each must follow from an attainable row
     (`steps.redundancy`).
"""

from dataclasses import dataclass

from trackable.checker.formulas.affine import UnsolvableError
from trackable.checker.reading.certificates import read_certificate
from trackable.checker.reading.values import UnreadableError
from trackable.checker.statement import statement
from trackable.checker.steps.boxes import check_boxes
from trackable.checker.steps.cover import check_cover
from trackable.checker.steps.instants import check_instants
from trackable.checker.steps.quantities import quantities
from trackable.checker.steps.redundancy import check_input_set
from trackable.checker.steps.rounding import check_rounding
from trackable.checker.steps.shapes import check_shapes
from trackable.checker.steps.sizes import check_sizes
from trackable.checker.steps.tail import check_tail
from trackable.checker.steps.trajectories import check_trajectories


@dataclass(frozen=True)
class Proved:
    """The certificate is valid; `statement` says in words what it proves."""

    statement: str


@dataclass(frozen=True)
class Failed:
    """The certificate can be read but proves nothing; `reason` names the first step that fails."""

    reason: str


@dataclass(frozen=True)
class NotACertificate:
    """The data cannot be read; `reason` says what it is instead, or names the first part that is wrong."""

    reason: str


Verdict = Proved | Failed | NotACertificate


def check(data: object) -> Verdict:
    """Verify the content of a certificate file: what its JSON says, as dicts, lists, strings and numbers."""
    try:
        certificate = read_certificate(data)
    except UnreadableError as error:
        return NotACertificate(str(error))
    for check_content in (check_shapes, check_trajectories, check_input_set, check_cover):
        if reason := check_content(certificate):
            return Failed(reason)
    try:
        bounded = quantities(certificate)
    except UnsolvableError as error:
        return Failed(f"system: {error}")
    for check_step in (check_sizes, check_rounding, check_boxes, check_instants, check_tail):
        if reason := check_step(certificate, bounded):
            return Failed(reason)
    return Proved(statement(certificate))
