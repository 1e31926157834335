(** Trajectories as data, in rational numbers: sums, multiples, the trajectory one step later, and whether one is 0. *)

From Coq Require Import Arith QArith Qreals Reals List Lra.
From Trackably Require Import Statement Jets Polynomials.
Import ListNotations.
Open Scope R_scope.

Definition nothing : trajectory := {| offset := 0; weights := [] |}.
Definition just (q : Q) : trajectory := {| offset := q; weights := [] |}.
Definition total (f g : trajectory) : trajectory :=
  {| offset := plus_exactly (offset f) (offset g);
     weights := longest (longest plus_exactly) (weights f) (weights g) |}.
Definition multiple (a : Q) (f : trajectory) : trajectory :=
  {| offset := times_exactly a (offset f); weights := map (map (times_exactly a)) (weights f) |}.
Definition later (f : trajectory) : trajectory :=
  {| offset := offset f; weights := map (cons 0%Q) (weights f) |}.
Definition vanishes (f : trajectory) : bool :=
  Qeq_bool (offset f) 0 && forallb (forallb (fun q => Qeq_bool q 0)) (weights f).

Fixpoint combination (row : list Q) (fs : list trajectory) : trajectory :=
  match row, fs with
  | a :: row', f :: fs' => total (multiple a f) (combination row' fs')
  | _, _ => nothing
  end.

Section Meaning.

Variables (T : R) (zs : list signal).

Lemma at_total f g t :
  trajectory_at T zs (total f g) t = trajectory_at T zs f t + trajectory_at T zs g t.
Proof.
  assert (S : forall v w z t, shifts T (longest plus_exactly v w) z t = shifts T v z t + shifts T w z t).
  { induction v as [|a v IH]; intros [|b w] z s; simpl; rewrite ?IH, ?Q2R_plus; ring. }
  assert (M : forall vs ws zs, sum_of_signals T (longest (longest plus_exactly) vs ws) zs t =
     sum_of_signals T vs zs t + sum_of_signals T ws zs t).
  { induction vs as [|v vs IH]; intros [|w ws] [|z zs']; simpl; rewrite ?IH, ?S; ring. }
  unfold trajectory_at, total. cbn [offset weights]. rewrite M, Q2R_plus. ring.
Qed.

Lemma at_multiple a f t : trajectory_at T zs (multiple a f) t = a * trajectory_at T zs f t.
Proof.
  assert (S : forall w z t, shifts T (map (times_exactly a) w) z t = a * shifts T w z t).
  { induction w as [|b w IH]; intros z s; simpl; rewrite ?IH, ?Q2R_times; ring. }
  assert (M : forall ws zs, sum_of_signals T (map (map (times_exactly a)) ws) zs t = a * sum_of_signals T ws zs t).
  { induction ws as [|w ws IH]; intros [|z zs']; simpl; rewrite ?IH, ?S; ring. }
  unfold trajectory_at, multiple. cbn [offset weights]. rewrite M, Q2R_times. ring.
Qed.

Lemma Q2R_0 : Q2R 0 = 0.
Proof. unfold Q2R. simpl. ring. Qed.

Lemma at_just q t : trajectory_at T zs (just q) t = q.
Proof. unfold trajectory_at, just. simpl. ring. Qed.

Lemma at_nothing t : trajectory_at T zs nothing t = 0.
Proof. unfold nothing. fold (just 0). now rewrite at_just, Q2R_0. Qed.

Lemma at_later f t : trajectory_at T zs (later f) t = trajectory_at T zs f (t + T).
Proof.
  assert (M : forall ws zs, sum_of_signals T (map (cons 0%Q) ws) zs t = sum_of_signals T ws zs (t + T)).
  { induction ws as [|w ws IH]; intros [|z zs']; simpl; rewrite ?IH, ?Q2R_0; ring. }
  unfold trajectory_at, later. cbn [offset weights]. now rewrite M.
Qed.

Lemma at_vanishes f t : vanishes f = true -> trajectory_at T zs f t = 0.
Proof.
  unfold vanishes. intros [H W]%andb_prop.
  assert (E : forall q, Qeq_bool q 0 = true -> Q2R q = 0).
  { intros q Hq. apply Qeq_bool_eq in Hq. now rewrite (Qeq_eqR _ _ Hq), Q2R_0. }
  assert (S : forall w z t, forallb (fun q => Qeq_bool q 0) w = true -> shifts T w z t = 0).
  { induction w as [|b w IH]; intros z s; simpl; [easy|].
    intros [Hb Hw]%andb_prop. rewrite IH, E by easy. ring. }
  unfold trajectory_at. rewrite E by easy.
  enough (forall ws zs, forallb (forallb (fun q => Qeq_bool q 0)) ws = true -> sum_of_signals T ws zs t = 0) as ->
    by (trivial; ring).
  induction ws as [|w ws IH]; intros [|z zs'] Hws; simpl in *; trivial.
  apply andb_prop in Hws as [Hw Hws]. rewrite S, IH by easy. ring.
Qed.

Lemma at_combination row fs t :
  trajectory_at T zs (combination row fs) t = dot row (map (fun f => trajectory_at T zs f t) fs).
Proof.
  revert fs; induction row as [|a row IH]; intros [|f fs]; cbn [combination dot map]; trivial using at_nothing.
  now rewrite at_total, at_multiple, IH.
Qed.

End Meaning.

(** * The system: x(t + T) - A x(t) - B u(t) - c has no weight that is not 0 *)

Definition residual (states inputs : list trajectory) (e : equation) (f : trajectory) : trajectory :=
  total (later f) (multiple (-1) (total (total (combination (of_states e) states) (combination (of_inputs e) inputs))
    (just (constant e)))).

Fixpoint solves (states inputs : list trajectory) (system : list equation) (fs : list trajectory) : bool :=
  match system, fs with
  | [], [] => true
  | e :: system', f :: fs' => vanishes (residual states inputs e f) && solves states inputs system' fs'
  | _, _ => false
  end.

Lemma solves_sound c (t : R) :
  solves (states c) (inputs c) (system c) (states c) = true ->
  x c (t + sampling_time c) = successor (system c) (x c t) (u c t).
Proof.
  intros H. unfold x at 1, successor.
  enough (forall es fs, solves (states c) (inputs c) es fs = true ->
    map (fun f => trajectory_at (sampling_time c) (signals c) f (t + sampling_time c)) fs =
    map (fun e => dot (of_states e) (x c t) + dot (of_inputs e) (u c t) + constant e) es) as S by now apply S.
  induction es as [|e es IH]; intros [|f fs] Hs; simpl in Hs; try easy.
  apply andb_prop in Hs as [Hz Hs]. cbn [map]. f_equal; [|now apply IH].
  apply (at_vanishes (sampling_time c) (signals c) _ t) in Hz.
  unfold residual in Hz. rewrite at_total, at_later, at_multiple, !at_total, !at_combination, at_just in Hz.
  fold (x c t) (u c t) in Hz. replace (Q2R (-1)) with (-1) in Hz by (unfold Q2R; simpl; field). lra.
Qed.

(** * Bounds as trajectories that are nowhere negative *)

Definition distances (fs : list trajectory) (b : bound) : list trajectory :=
  let v := combination (row b) fs in
  match lower b with Some l => [total v (just (- l))] | None => [] end ++
  match upper b with Some h => [total (just h) (multiple (-1) v)] | None => [] end.

Lemma distances_sound (T : R) zs fs b t :
  (forall f, In f (distances fs b) -> 0 <= trajectory_at T zs f t) <->
  within b (map (fun f => trajectory_at T zs f t) fs).
Proof.
  unfold distances, within.
  assert (L : forall l : Q, trajectory_at T zs (total (combination (row b) fs) (just (- l))) t =
    dot (row b) (map (fun f => trajectory_at T zs f t) fs) - l).
  { intros l. rewrite at_total, at_combination, at_just, Q2R_opp. ring. }
  assert (U : forall h : Q, trajectory_at T zs (total (just h) (multiple (-1) (combination (row b) fs))) t =
    h - dot (row b) (map (fun f => trajectory_at T zs f t) fs)).
  { intros l. rewrite at_total, at_multiple, at_combination, at_just.
    replace (Q2R (-1)) with (-1) by (unfold Q2R; simpl; field). ring. }
  split.
  - intros H. split.
    + destruct (lower b) as [l|]; [|easy]. specialize (H _ (or_introl eq_refl)). rewrite L in H. lra.
    + destruct (upper b) as [h|]; [|easy].
      specialize (H _ (in_or_app _ [_] _ (or_intror (or_introl eq_refl)))). rewrite U in H. lra.
  - intros [Hl Hu] f [Hf|Hf]%in_app_or.
    + destruct (lower b) as [l|]; [|easy]. destruct Hf as [<-|[]]. rewrite L. lra.
    + destruct (upper b) as [h|]; [|easy]. destruct Hf as [<-|[]]. rewrite U. lra.
Qed.

(** * A trajectory at rest, and its deviation from it: z = m + e *)

Definition sum_exactly (w : list Q) : Q := fold_right plus_exactly 0%Q w.

Fixpoint sum_at_rest (ws : list (list Q)) (zs : list signal) : Q :=
  match ws, zs with
  | w :: ws', z :: zs' => plus_exactly (times_exactly (mean z) (sum_exactly w)) (sum_at_rest ws' zs')
  | _, _ => 0
  end.

Definition rest (zs : list signal) (f : trajectory) : Q := plus_exactly (offset f) (sum_at_rest (weights f) zs).

Definition deviation_of (z : signal) : R -> R := deviation (prior z) (terms z).

Fixpoint sum_of_deviations (T : R) (ws : list (list Q)) (zs : list signal) (t : R) : R :=
  match ws, zs with
  | w :: ws', z :: zs' => shifts T w (deviation_of z) t + sum_of_deviations T ws' zs' t
  | _, _ => 0
  end.

Lemma at_rest T zs f t :
  trajectory_at T zs f t = rest zs f + sum_of_deviations T (weights f) zs t.
Proof.
  assert (S : forall z w t, shifts T w (signal_at z) t = mean z * sum_exactly w + shifts T w (deviation_of z) t).
  { intros z; induction w as [|a w IH]; intros s; cbn [shifts sum_exactly fold_right].
    - rewrite Q2R_0. ring.
    - fold (sum_exactly w). rewrite IH, Q2R_plus. unfold signal_at, deviation_of. ring. }
  unfold trajectory_at, rest. rewrite Q2R_plus, Rplus_assoc. f_equal.
  generalize (weights f). intros ws; revert zs. induction ws as [|w ws IH]; intros [|z zs];
    cbn [sum_of_signals sum_at_rest sum_of_deviations]; rewrite ?Q2R_0; try ring.
  rewrite S, IH, Q2R_plus, Q2R_times. ring.
Qed.

(** * Each shift of a signal as a signal of its own: z(t + d) has its centres earlier by d *)

Definition earlier (d : Q) (z : signal) : signal :=
  {| prior := prior z; mean := mean z;
     terms := map (fun i => {| weight := weight i; centre := plus_exactly (centre i) (- d) |}) (terms z) |}.

Fixpoint copies (T d : Q) (k : nat) (z : signal) : list signal :=
  match k with
  | O => []
  | S k' => earlier d z :: copies T (plus_exactly d T) k' z
  end.

Fixpoint singles (k : nat) (w : list Q) : list (list Q) :=
  match k, w with
  | O, _ => []
  | S k', [] => [] :: singles k' []
  | S k', a :: w' => [a] :: singles k' w'
  end.

Definition copied (T : Q) (k : nat) (zs : list signal) : list signal := flat_map (copies T 0 k) zs.
Definition single (k : nat) (f : trajectory) : trajectory :=
  {| offset := offset f; weights := flat_map (singles k) (weights f) |}.

Definition short (k : nat) (f : trajectory) : bool := forallb (fun w => Nat.leb (length w) k) (weights f).

Lemma at_earlier d z t : signal_at (earlier d z) t = signal_at z (t + d).
Proof.
  unfold signal_at, earlier. cbn [mean prior terms]. f_equal.
  induction (terms z) as [|i l IH]; cbn [map deviation weight centre]; [easy|].
  rewrite IH, Q2R_plus, Q2R_opp. do 3 f_equal. ring.
Qed.

Lemma sum_of_copies (T : Q) k z w d ws zs t :
  (length w <= k)%nat ->
  sum_of_signals T (singles k w ++ ws) (copies T d k z ++ zs) t =
  shifts T w (signal_at z) (t + d) + sum_of_signals T ws zs t.
Proof.
  revert w d; induction k as [|k IH]; intros w d Hw.
  - destruct w; [simpl; ring|simpl in Hw; inversion Hw].
  - destruct w as [|a w]; cbn [singles copies app sum_of_signals shifts].
    + rewrite IH by (simpl; apply Nat.le_0_l). simpl. ring.
    + rewrite IH by (simpl in Hw; now apply le_S_n). rewrite at_earlier, Q2R_plus.
      replace (t + d + T) with (t + (d + T)) by ring. ring.
Qed.

Lemma at_single (T : Q) k zs f t :
  short k f = true -> trajectory_at T (copied T k zs) (single k f) t = trajectory_at T zs f t.
Proof.
  unfold trajectory_at, short, single, copied. cbn [offset weights]. intros H. f_equal.
  revert zs H. induction (weights f) as [|w ws IH]; intros [|z zs] H; try easy.
  - cbn [flat_map]. now destruct (singles k w ++ _).
  - cbn [forallb flat_map] in *. apply andb_prop in H as [Hw H]. apply PeanoNat.Nat.leb_le in Hw.
    rewrite sum_of_copies, IH by easy. cbn [sum_of_signals]. rewrite Q2R_0. now rewrite Rplus_0_r.
Qed.
