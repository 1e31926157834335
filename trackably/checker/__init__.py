"""Judge certificates: the checker imports nothing of what learns a reference and proposes its proof.

Theorem. A certificate holds signals z_s(t) = m_s + Σ_i c_si κ_s(t − t_si), a system with sampling time T, a state set X
and an input set U, both of the form {v : lower ≤ R v ≤ upper}. Every stored float64 stands for exactly one real number,
its own value. The system is
  - linear, x⁺ = A x + B u + c. The certificate then also holds, in rational numbers, M, N, x₀ and u₀: let
    x(t) = x₀ + Σ_s Σ_j M_sj z_s(t + j T) and u(t) = u₀ + Σ_s Σ_j N_sj z_s(t + j T);
  - or nonlinear, x⁺ = f(x, u), with formulas f and as many inputs as states and signals: let x_i(t) = z_i(t), and let
    u(t) be the only solution of f(x(t), u) = x(t + T). The proof includes that u(t) exists and is unique;
  - or nonlinear with a flat form: formulas X and U of shifted signals, and a list of states that are angles. Let
    x(t) = X(z(t), z(t + T), …) and u(t) = U(z(t), z(t + T), …). The proof includes that both are defined.
Instead of sums of kernels, all signals of a linear system may be polynomial pieces: z_s(t) = Σ_j c_ij (t − t_i)^j for
t_i ≤ t < t_(i+1), and beyond the last piece at rest, periodic, or without any claim (`subject`).
If `check` answers Proved, then x(t + T) = A x(t) + B u(t) + c, or f(x(t), u(t)), and x(t) ∈ X and u(t) ∈ U, for
  - all_times:  every real t ≥ 0;
  - all_phases: every real t;
  - window:     every real t from start to end;
  - instants:   every t = k T, k = 0, 1, 2, …
So the system follows the states x(k T) with the admissible inputs u(k T). Of a flat form with angles, x(t + T) and
f(x(t), u(t)) may differ by multiples of 2π in states that are angles, and f changes by such multiples if they do; so
there are multiples of 2π which, added to the angles in x(k T), give states that the system follows exactly, with the
same u(k T). Bounds of an angle are those of x(t) as X gives it. The distance from each bound exceeds the
error of evaluating x(t), u(t) and the bound's row in float64, at float64 times |t| ≤ until among these times (the field
`evaluation`). A time k T may be rounded to float64 for it. For all_phases of kernels, a time t or k T may be moved by
whole periods to such a time before, which may be off by 2⁻⁵³ until.

Which reference. The answer names the SHA-256 of all that defines x(t) and u(t): the signals, the system with its flat
form, and M, N, x₀ and u₀ (`form` has the canonical form). Certificates and counterexamples with the same
one speak about the same system, x(t) and u(t). It does not pin the sets, the claim, K, W and V, all of which the answer
states, nor v(t), of which only the existence is proved.

Counterexamples. A file of this form holds a time of the claim instead of boxes. If `check` answers Refuted, then at
this time x(t) ∉ X, or no u ∈ U has x(t + T) = A x(t) + B u + c, or x(t + T) = f(x(t), u). Of a flat form: x(t) ∉ X,
or u(t) ∉ U.

Contradictions. If `check` answers Impossible, no states and inputs at some steps keep the bounds and the values that
the answer names, whatever reference is wanted (`contradiction`, with its form, theorem and proof).

Redundant inputs. The certificate of a linear system may also hold `attainable` rows; u(t) is then bounded by these rows
instead of U. If `check` answers Proved, then at each of these times there is a v(t) with B v(t) = 0 and
u(t) + v(t) ∈ U. So the system follows the states x(k T) with the admissible inputs u(k T) + v(k T).

Disturbances. The certificate of a linear system may also hold a matrix K, a set W, and sets X₀ and U₀ with the rows of
X and U. Let x_r and u_r be the x(t), and the u(t) or u(t) + v(t), from above. If `check` answers Proved, then for each
t₀ of these times, each x(0) = x_r(t₀) + e with e ∈ Z, and each sequence of w(k) ∈ W, the system
x(k + 1) = A x(k) + B u(k) + c + w(k) with u(k) = u_r(t₀ + k T) + K (x(k) − x_r(t₀ + k T)) has x(k) ∈ X₀ and u(k) ∈ U₀
for all k ≥ 0 with t₀ + k T among these times. Z is a set that follows from A, B, K and W (step 7); it holds 0 if W
does. What rounding adds to a state counts as a part of w.

Measurement noise. Such a certificate may also hold a set V. The state is then measured as y(k) = x(k) + v(k). The same
holds for each y(0) = x_r(t₀) + e with e ∈ Z, and all sequences of w(k) ∈ W and v(k) ∈ V, with
u(k) = u_r(t₀ + k T) + K (y(k) − x_r(t₀ + k T)).

Assumptions about rounding. Arithmetic is IEEE's, with subnormal numbers. exp, log, sqrt, sin, cos, atan, atan2 and
powers are within 4 units in the last place. The evaluated formulas are those of κ in `kernels`, sums of products in any
order (no fast Fourier transforms), and for nonlinear systems the formulas of u found in step 0, or those of the flat
form. The first pass of steps 2, 3 and 5 assumes the same of NumPy's arithmetic, exp, log, sqrt, cos, arctan and
arctan2, and so do the six digits that are printed of x(0). A check that is `exact`, or without NumPy, or where the
processor takes subnormal numbers for zero, leaves both out: then nothing but the errors of evaluation (step 5) rests on
these assumptions. The answer says which arithmetic it trusted.

Polynomial pieces are evaluated in double-double arithmetic, at times that are not rounded; each state or
input is rounded to float64 once.

Limits. Files are read up to 32 MB, with up to 100 signals, states and inputs, 100 shifts and 500,000 centres of a
signal, 10,000 rows of a set, 500,000 boxes of a bound or instants, 64 Taylor terms, 10,000 powers of A + B K, rational
numbers of 4,000 characters, texts of 500,000 characters together, 1,000,000 weights of shifted signals in all bounds
together, 100 coefficients of a piece, 100 kernels in one, nested 40 deep, and 30,000 parts of all formulas together,
nested 100 deep; the formula of an input has up to 10,000. Polynomials of step 0 have up to 5000 terms, with 80 values
of functions. What exceeds them is refused (`limits`). A check is Undecided where it would need a rational number of
more than 500,000 bits, whole numbers of more than 1,000,000,000 bits together, more than 500,000 breakpoints of pieces
in one bound, or 700 MB of memory beyond what the process has held before (where the system tells), and after the time
that it may be given.

Proof. Every step is verified here, in interval arithmetic (mpmath iv); steps 0, 6, 7 and 8 in rational arithmetic;
step 2, what step 5 finds in each box, and R and D of step 3, first in arrays of float64 intervals, and in mpmath where
these do not decide.
  0. Linear: x₀ = A x₀ + B u₀ + c, and M_s(j−1) = A M_sj + B N_sj for all j, with zeros beyond the ends
     (`trajectories`). Nonlinear: f is split into f0(x) + G(x) u, or refused, and x⁺ = f0(x) + G(x) u is
     solved for u, by u_j = (x⁺_i − f0_i − Σ known G u)/G_ij for equations with a single unknown and by Cramer's rule
     for the others (`inverse`). Every part of f is in the formula of some input, and every input is in some
     bound. So where all bounded formulas are shown to be defined (no divisor is zero; arguments of log, sqrt and
     fractional powers are positive), f is defined, and u exists and is unique.
     Flat: f(X, U) and X with every signal one step later are written as quotients of polynomials in the signals and in
     values of functions, by true equalities such as √a² = a and cos(atan2(y, x)) = x/√(x² + y²); they are the same
     quotients, and so equal wherever all parts are defined and the formulas in `positive` are positive
     (`identities`, `flatness`). Of angles, sines and cosines are compared. Where a state that is an
     angle changes by 2π, f changes by whole multiples of 2π in states that are angles, and not at all in others: seen
     from its sums, products with whole numbers, sines and cosines. All parts are shown to be defined in the boxes and
     in the tail, together with the last bound: divisors, lengths of vectors whose angle is taken, and arguments of log,
     sqrt and fractional powers, in X, U, f(X, U) and X one step later (`identities.flatness.needs`, `flat`).
  1. Boxes without gaps cover [0, tail_start], one period, or the window (`boxes`).
  2. Consider a box with midpoint s and half width h < ρ, and let |κ(z − t_i)| ≤ M for complex |z − s| < ρ. By Cauchy's
     estimate, the error of the first n terms of κ's Taylor series about s is at most M (h/ρ)ⁿ/(1 − h/ρ). A kernel may
     have kinks, at a difference of 0 and where its support ends; between them it is analytic. The branch κ₊ that holds
     in the middle of the box is continued over all of the box. At most two errors are added. If a kink at 0 is in the
     box, the error at distance r beyond it is |κ₊(r) − κ₊(−r)|, as κ is even: twice the odd powers of the Taylor series
     of κ₊ about 0, which are bounded in the same way. If other kinks are in the box, the error beyond them is the
     distance of κ from κ₊ on the positive side (`jump`). κ is even, so that both together bound the error on the
     negative side. A box that contains 0, but whose middle is on another branch, is refused (`kernels`). Formulas
     of such polynomials are again polynomials, with a bound of their error (`models`). A polynomial lies in
     the convex hull of its Bernstein coefficients, on the whole box or on each of its parts (`models`,
     `boxes`).
     Centres at distances ≥ d from all times of a box are not expanded: together they add at most Σ |c_i| K, where K
     bounds |κ| at all distances ≥ d, as in step 3 (`reach`). The first pass (`floats`) uses the same formulas. Each of
     its operations moves both ends of its result outwards, by more than rounding can be off; what overflows or is not
     defined becomes NaN, which no comparison calls certain. Shifts j T of one signal may share its polynomial over the
     times of all of them, in which a + b x is put for x. An instant is first tried as a narrow box around it. Whether a
     kink is inside a box is decided in rational arithmetic. Of a Matérn kernel, the first pass expands no centre
     outside of a box: on one side of all its centres their sum is a polynomial times an exponential, whose coefficients
     are those of Taylor's formula for the polynomial (`kernels`). The sum is expanded in its place, and Σ |c_i|
     M bounds it on the disc.
  3. Let e = z − m, and let t₀ be `tail_start`, or the first instant after those checked one by one (`instants`).
     Let K_i and D_i bound |κ(r)| and |κ̇(r)| at all distances r = t − t_i with t ≥ t₀. Then, for all t ≥ t₀,
     |e(t)| ≤ R = Σ |c_i| K_i and |ė(t)| ≤ D = Σ |c_i| D_i. So |Σ_j w_j e(t + j T)| is at most Σ_j |w_j| R. As the sum
     equals Σ_j w_j e(t) + Σ_j w_j (e(t + j T) − e(t)), it is also at most |Σ_j w_j| R + T Σ_j j |w_j| D. By the
     mean-value theorem, a formula differs from its value at rest by such a sum, whose weights are the slopes of the
     formula at some point between (`tail`).
  4. If all parts of κ have the same period, what holds for one period of t holds for all t (`boxes`).
  5. The rounding errors are at most the stated errors. Those of a nonlinear u are propagated through its formula, with
     x(t) inside its bounds, as the steps above have shown (`rounding`). Those of a flat form are propagated in
     each box, from the values that the signals have there (`flat`).
  6. Let the columns of Z span the kernel of B. By Farkas' lemma there is a w with lower_i ≤ r_i (u + Z w) ≤ upper_i for
     all rows of U if Σ_i λ_i r_i u lies between Σ_i λ_i lower_i and Σ_i λ_i upper_i (ends exchanged where λ_i < 0) for
     all λ with Σ_i λ_i r_i Z = 0. It is enough to know this for the λ of minimal support, because every other λ is a
     conformal sum of these (no cancellation of signs): R. T. Rockafellar, The elementary vectors of a subspace of R^N,
     1969. They are enumerated, and each must follow from an attainable row (`redundancy`).
  7. Let F = A + B K. The certificate holds whole numbers N, s ≥ 1, a number 0 ≤ α < 1, and sizes p_i ≥ 0 of a box
     P = {x : |x_i| ≤ p_i}. Verified are W ⊆ P, and Fˢ P ⊆ α P: Σ_j |(Fˢ)_ij| p_j ≤ α p_i for all i. Let
     Y = (1 − α)⁻¹ (P ⊕ F P ⊕ … ⊕ Fˢ⁻¹ P). Then F Y ⊕ P ⊆ Y: as Fˢ P ⊆ α P and P is convex, F Y ⊕ P is inside of
     (1 − α)⁻¹ (F P ⊕ … ⊕ Fˢ⁻¹ P ⊕ α P) ⊕ P = Y. Let Z = W ⊕ F W ⊕ … ⊕ Fᴺ⁻¹ W ⊕ Fᴺ Y. Then F Z ⊕ W ⊆ Z, because it is
     W ⊕ F W ⊕ … ⊕ Fᴺ⁻¹ W ⊕ Fᴺ (W ⊕ F Y). The errors e(k) = x(k) − x_r(t₀ + k T) obey e(k + 1) = F e(k) + w(k), so that
     all of them are in Z. For each row r of X and its bounds l ≤ r x ≤ h in X and l₀ ≤ r x ≤ h₀ in X₀, verified are
     h + h_Z(r) ≤ h₀ and l₀ ≤ l − h_Z(−r), with the support function h_Z(r) = max {r e : e ∈ Z}, which is
     Σ_{i<N} h_W(r Fⁱ) + (1 − α)⁻¹ Σ_{i<s} Σ_j |(r Fᴺ⁺ⁱ)_j| p_j; and likewise for each row r of U with h_Z(r K). So
     r x(k) = r x_r + r e(k) and r u(k) = r u_r + r K e(k) keep the bounds of X₀ and U₀. Y with W in the place of P is
     the set of S. V. Raković et al., Invariant approximations of the minimal robust positively invariant set, 2005.
     Where there is a V, y(k + 1) = A y(k) + B u(k) + c + w(k) − A v(k) + v(k + 1). So all of this is verified with
     W ⊕ (−A V) ⊕ V in the place of W, for the errors y(k) − x_r. As x = y − v, the bounds of X₀ have to be further
     out, by h_V(−r) above and h_V(r) below. All of it is done in whole numbers over common denominators
     (`disturbances`).
  8. Polynomial pieces need none of the steps 1 to 5. Between two breakpoints t_i − j T of its signals, a bounded
     quantity is one polynomial with rational coefficients (`subject`). In each of these cells, closed on
     both sides, it is shown to keep its bounds, drawn in by the stated errors. With x = y/(1 + y), a polynomial p(x) of
     degree n becomes (1 + y)⁻ⁿ Σ b_k y^k, and 0 ≤ x ≤ 1 becomes y ≥ 0: where all b_k ≥ 0, p is nowhere negative; where
     some are not, the cell is halved (`subject`). For all_times the cells reach from 0 to `tail_start`,
     where all signals are at rest; for all_phases over one period; for a window from start to end, where a signal that
     ends must be known until the last t + j T. The rounding errors are at most the stated ones
     (`subject`). Steps 0, 6 and 7 are the same.
  Of a table of states and inputs at steps: at each step, the rows of X and U are kept, and |x(k + 1) − f(x(k), u(k))|
  is at most the tolerance for each state, in rational arithmetic for linear systems (`tables`). Nothing is said
  about times between the steps, nor about a flat form. Of a refuted table: at the step that it names, one of these is
  broken by at least what it names, as a number.
  Of a counterexample: step 0; the time is one of the claim; and the value of the bound's row at this time, a number, is
  outside (`counterexample`). Of redundant inputs it must also be outside of what step 6 demands for one λ: that this
  is necessary needs no lemma.
"""

from collections.abc import Callable

from trackably.checker.answers import (
    Failed,
    Impossible,
    NotACertificate,
    Proved,
    Refuted,
    Undecided,
    Verdict,
    impossible,
    of_refuted_table,
    of_table,
    proved,
    refuted,
)
from trackably.checker.boxes import NO_FIRST_PASS, FirstPass
from trackably.checker.certificate import FORMAT
from trackably.checker.contradiction import FORMAT as CONTRADICTION
from trackably.checker.contradiction import read_contradiction
from trackably.checker.counterexample import FORMAT as COUNTEREXAMPLE
from trackably.checker.form import (
    UnreadableError,
    format_of,
    read_certificate,
    read_counterexample,
    read_refuted_table,
    read_table,
    require_short_texts,
)
from trackably.checker.tables import FORMAT as TABLE
from trackably.checker.tables import REFUTED as REFUTED_TABLE
from trackably.checker.watch import Report, UndecidedError, watched

try:
    from trackably.checker.floats.boxes import FIRST_PASS
except ImportError:  # there is no NumPy
    FIRST_PASS = NO_FIRST_PASS

__all__ = ["Failed", "Impossible", "NotACertificate", "Proved", "Refuted", "Undecided", "Verdict", "check"]


def check(data: object, seconds: float | None = None, report: Report | None = None, exact: bool = False) -> Verdict:
    """Verify the content of a certificate's, counterexample's, table's or contradiction's file: what its JSON says.

    A check that takes longer than `seconds` answers Undecided. `report` is told how far it is. An `exact` check does
    without float64 intervals.
    """
    try:
        with watched(seconds, report):
            return _check(data, FIRST_PASS if not exact and FIRST_PASS.is_sound() else NO_FIRST_PASS)
    except UndecidedError as error:
        return Undecided(str(error))
    except MemoryError:
        return Undecided("not decided within the memory that there is")


def _check(data: object, first_pass: FirstPass) -> Verdict:
    answers: dict[str, Callable[[dict[object, object]], Verdict]] = {
        FORMAT: lambda content: proved(read_certificate(content), first_pass),
        COUNTEREXAMPLE: lambda content: refuted(read_counterexample(content), first_pass),
        CONTRADICTION: lambda content: impossible(read_contradiction(content)),
        TABLE: lambda content: of_table(read_table(content)),
        REFUTED_TABLE: lambda content: of_refuted_table(read_refuted_table(content)),
    }
    try:
        require_short_texts(data)
        if isinstance(data, dict) and (kind := format_of(data)) in answers:
            return answers[kind](data)
    except UnreadableError as error:
        return NotACertificate(str(error))
    return NotACertificate(f"is not a certificate: certificate.format must be {FORMAT!r}")
