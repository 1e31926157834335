(** What a certificate states, in real numbers: this file is all that a reader has to understand.

    A certificate holds signals z_s(t) = m_s + sum_i c_i kappa_s(t - t_i), a linear system x+ = A x + B u + c with
    sampling time T, and trajectories x(t) and u(t) that are sums of weights times z_s(t + j T). [holds] says that
    these trajectories solve the system at every real time, and keep all bounds at every time of the claim.

    All numbers are rational: a float64 is exactly its own value. *)

From Coq Require Import QArith Qreals Reals List.
Import ListNotations.
Open Scope R_scope.
Coercion Q2R : Q >-> R.

(** * Signals *)

Inductive kernel : Set :=
  | SquaredExponential (signal_std lengthscale : Q)
  | Periodic (signal_std lengthscale period : Q)
  | Matern32 (signal_std lengthscale : Q)
  | Matern52 (signal_std lengthscale : Q)
  | Sum (left right : kernel)
  | Product (left right : kernel).

(** kappa(r), for a difference r of times. *)
Fixpoint kappa (k : kernel) (r : R) : R :=
  match k with
  | SquaredExponential s l => s ^ 2 * exp (- (r ^ 2) / (2 * l ^ 2))
  | Periodic s l p => s ^ 2 * exp (- 2 * sin (PI * r / p) ^ 2 / l ^ 2)
  | Matern32 s l => let x := sqrt 3 * Rabs r / l in s ^ 2 * ((1 + x) * exp (- x))
  | Matern52 s l => let x := sqrt 5 * Rabs r / l in s ^ 2 * ((1 + x + x ^ 2 / 3) * exp (- x))
  | Sum a b => kappa a r + kappa b r
  | Product a b => kappa a r * kappa b r
  end.

Record term : Set := { weight : Q; centre : Q }.
Record signal : Set := { prior : kernel; mean : Q; terms : list term }.

(** The sum of c_i kappa(t - t_i). *)
Fixpoint deviation (k : kernel) (l : list term) (t : R) : R :=
  match l with
  | [] => 0
  | i :: l' => weight i * kappa k (t - centre i) + deviation k l' t
  end.

(** z(t) *)
Definition signal_at (z : signal) (t : R) : R := mean z + deviation (prior z) (terms z) t.

(** * Trajectories *)

(** The sum of w_j z(t + j T), for j = 0, 1, ... *)
Fixpoint shifts (T : R) (w : list Q) (z : R -> R) (t : R) : R :=
  match w with
  | [] => 0
  | w0 :: w' => w0 * z t + shifts T w' z (t + T)
  end.

(** A state or an input: a constant, and for each signal one weight for each shift. *)
Record trajectory : Set := { offset : Q; weights : list (list Q) }.

Fixpoint sum_of_signals (T : R) (ws : list (list Q)) (zs : list signal) (t : R) : R :=
  match ws, zs with
  | w :: ws', z :: zs' => shifts T w (signal_at z) t + sum_of_signals T ws' zs' t
  | _, _ => 0
  end.

Definition trajectory_at (T : R) (zs : list signal) (f : trajectory) (t : R) : R :=
  offset f + sum_of_signals T (weights f) zs t.

(** * System, bounds, claims *)

Fixpoint dot (row : list Q) (v : list R) : R :=
  match row, v with
  | a :: row', x :: v' => a * x + dot row' v'
  | _, _ => 0
  end.

(** One row of x+ = A x + B u + c. *)
Record equation : Set := { of_states : list Q; of_inputs : list Q; constant : Q }.

Definition successor (system : list equation) (x u : list R) : list R :=
  map (fun e => dot (of_states e) x + dot (of_inputs e) u + constant e) system.

(** lower <= row v <= upper, where [None] is no bound. *)
Record bound : Set := { row : list Q; lower : option Q; upper : option Q }.

Definition within (b : bound) (v : list R) : Prop :=
  match lower b with Some l => l <= dot (row b) v | None => True end /\
  match upper b with Some h => dot (row b) v <= h | None => True end.

Inductive claim : Set := AllTimes | AllPhases | Window (start stop : Q) | Instants.

Definition claimed (c : claim) (T t : R) : Prop :=
  match c with
  | AllTimes => 0 <= t
  | AllPhases => True
  | Window a b => a <= t <= b
  | Instants => exists k : nat, t = INR k * T
  end.

(** * The theorem of a certificate *)

Record certificate : Set := {
  signals : list signal;
  sampling_time : Q;
  system : list equation;
  states : list trajectory;
  inputs : list trajectory;
  state_set : list bound;
  input_set : list bound;
  times : claim }.

Definition x (c : certificate) (t : R) : list R :=
  map (fun f => trajectory_at (sampling_time c) (signals c) f t) (states c).
Definition u (c : certificate) (t : R) : list R :=
  map (fun f => trajectory_at (sampling_time c) (signals c) f t) (inputs c).

Definition holds (c : certificate) : Prop :=
  (forall t : R, x c (t + sampling_time c) = successor (system c) (x c t) (u c t)) /\
  (forall t : R, claimed (times c) (sampling_time c) t ->
     (forall b, In b (state_set c) -> within b (x c t)) /\
     (forall b, In b (input_set c) -> within b (u c t))).

(** * Disturbed systems *)

(** All middle + s_0 g_0 + s_1 g_1 + ... with each |s_j| <= 1, for generators g_j; what is missing in a vector is 0. *)
Record zonotope : Set := { middle : list Q; generators : list (list Q) }.

Fixpoint mixture (s : nat -> R) (gs : list (list Q)) (i : nat) : R :=
  match gs with
  | [] => 0
  | g :: gs' => s 0%nat * nth i g 0%Q + mixture (fun j => s (S j)) gs' i
  end.

Definition in_zonotope (Z : zonotope) (w : nat -> R) : Prop :=
  exists s, (forall j, -1 <= s j <= 1) /\ forall i, w i = nth i (middle Z) 0%Q + mixture s (generators Z) i.

Record disturbance : Set := {
  feedback : list (list Q);
  pushes : zonotope;
  noise : zonotope;
  all_states : list bound;
  all_inputs : list bound }.

(** x(k + 1) = A x(k) + B u(k) + c + w(k), where the state is measured as y(k) = x(k) + v(k), the input is
    u(k) = u_r + K (y(k) - x_r) with the certificate's x_r and u_r at t0 + k T, and y(0) = x_r at t0. *)
Definition runs (c : certificate) (d : disturbance) (t0 : R) (xs us : nat -> list R) (w v : nat -> nat -> R) : Prop :=
  let t k := t0 + INR k * sampling_time c in
  let off k i := nth i (xs k) 0 + v k i - nth i (x c (t k)) 0 in
  (forall i, off 0%nat i = 0) /\
  (forall k i, nth i (us k) 0 =
     nth i (u c (t k)) 0 + dot (nth i (feedback d) []) (map (off k) (seq 0 (length (states c))))) /\
  (forall k i, nth i (xs (S k)) 0 = nth i (successor (system c) (xs k) (us k)) 0 + w k i).

(** Whatever disturbances and noise do, the bounds of [all_states] and [all_inputs] are kept at the times of the claim. *)
Definition withstands (c : certificate) (d : disturbance) : Prop :=
  forall t0 xs us w v,
    runs c d t0 xs us w v -> (forall k, in_zonotope (pushes d) (w k)) -> (forall k, in_zonotope (noise d) (v k)) ->
    forall k, claimed (times c) (sampling_time c) (t0 + INR k * sampling_time c) ->
      (forall b, In b (all_states d) -> within b (xs k)) /\ (forall b, In b (all_inputs d) -> within b (us k)).
