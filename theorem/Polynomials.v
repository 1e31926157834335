(** Polynomials as lists of coefficients of any type: real numbers for proofs, intervals for computing. *)

From Coq Require Import QArith Qreals Reals List Lra Lia.
From Trackably Require Import Statement Jets.
Import ListNotations.
Open Scope R_scope.

(** Add two lists entry by entry; missing entries of the shorter list count as 0. *)
Fixpoint longest {A} (add : A -> A -> A) (p q : list A) : list A :=
  match p, q with
  | [], _ => q
  | _, [] => p
  | a :: p', b :: q' => add a b :: longest add p' q'
  end.

Section Operations.

Variables (A : Type) (zero : A) (add mul : A -> A -> A).

(** p (m + x) as a polynomial in x. *)
Fixpoint recentred (m : A) (p : list A) : list A :=
  match p with
  | [] => []
  | c :: p' => let q := recentred m p' in longest add (c :: q) (map (mul m) q)
  end.

(** p (x + h) as a polynomial in x, whose coefficients are polynomials in h. *)
Fixpoint two_variables (p : list A) : list (list A) :=
  match p with
  | [] => []
  | c :: p' =>
    match two_variables p' with
    | [] => [[c]]
    | (q :: b') as b => longest (longest add) ([] :: b) ((c :: q) :: map (cons zero) b')
    end
  end.

(** sum_i s_i b_i *)
Fixpoint contract (s : list A) (b : list (list A)) : list A :=
  match s, b with
  | s0 :: s', q :: b' => longest add (map (mul s0) q) (contract s' b')
  | _, _ => []
  end.

(** [w; w x; w x^2; ...], n of them *)
Fixpoint powers (w x : A) (n : nat) : list A :=
  match n with
  | O => []
  | S n' => w :: powers (mul w x) x n'
  end.

End Operations.
Arguments recentred {A}. Arguments two_variables {A}. Arguments contract {A}. Arguments powers {A}.

(** * What they mean for real numbers *)

Fixpoint horner2 (b : list (list R)) (x h : R) : R :=
  match b with
  | [] => 0
  | q :: b' => horner q h + x * horner2 b' x h
  end.

Lemma horner_longest p q x : horner (longest Rplus p q) x = horner p x + horner q x.
Proof. revert q; induction p as [|a p IH]; intros [|b q]; simpl; rewrite ?IH; ring. Qed.

Lemma horner_scale c p x : horner (map (Rmult c) p) x = c * horner p x.
Proof. induction p as [|a p IH]; simpl; rewrite ?IH; ring. Qed.

Lemma horner_recentred m p x : horner (recentred Rplus Rmult m p) x = horner p (m + x).
Proof.
  induction p as [|c p IH]; [easy|]. cbn [recentred].
  rewrite horner_longest, horner_scale. cbn [horner]. rewrite IH. ring.
Qed.

Lemma horner2_longest b c x h : horner2 (longest (longest Rplus) b c) x h = horner2 b x h + horner2 c x h.
Proof. revert c; induction b as [|p b IH]; intros [|q c]; simpl; rewrite ?IH, ?horner_longest; ring. Qed.

Lemma horner2_cons b x h : horner2 (map (cons 0) b) x h = h * horner2 b x h.
Proof. induction b as [|p b IH]; simpl; rewrite ?IH; ring. Qed.

Lemma horner2_two_variables p x h : horner2 (two_variables 0 Rplus p) x h = horner p (x + h).
Proof.
  induction p as [|c p IH]; [easy|]. cbn [two_variables horner]. rewrite <- IH.
  destruct (two_variables 0 Rplus p) as [|q b]; [simpl; ring|].
  rewrite horner2_longest. cbn [horner2 horner]. rewrite horner2_cons. ring.
Qed.

Lemma horner_contract_longest s s' b x :
  horner (contract Rplus Rmult (longest Rplus s s') b) x =
  horner (contract Rplus Rmult s b) x + horner (contract Rplus Rmult s' b) x.
Proof.
  revert s' b; induction s as [|a s IH]; intros [|a' s'] [|q b]; simpl; try ring.
  rewrite !horner_longest, !horner_scale, IH. ring.
Qed.

Lemma horner_contract_powers w x n b h :
  (length b <= n)%nat -> horner (contract Rplus Rmult (powers Rmult w x n) b) h = w * horner2 b x h.
Proof.
  revert w b; induction n as [|n IH]; intros w [|q b] H; simpl in *; try ring; [lia|].
  rewrite horner_longest, horner_scale, IH by lia. ring.
Qed.

Lemma length_longest {A} (add : A -> A -> A) p q : length (longest add p q) = Nat.max (length p) (length q).
Proof. revert q; induction p as [|a p IH]; intros [|b q]; simpl; auto. Qed.

Lemma length_two_variables p : length (two_variables 0 Rplus p) = length p.
Proof.
  induction p as [|c p IH]; [easy|]. cbn [two_variables length]. rewrite <- IH.
  destruct (two_variables 0 Rplus p) as [|q b]; [easy|].
  rewrite length_longest. cbn [length]. rewrite map_length. lia.
Qed.

(** * Moments of a row of shifts: sum_j w_j (x + j T)^i for i < n, exactly *)

Definition plus_exactly (a b : Q) : Q := Qred (a + b).
Definition times_exactly (a b : Q) : Q := Qred (a * b).

Fixpoint moments (n : nat) (T x : Q) (w : list Q) : list Q :=
  match w with
  | [] => []
  | w0 :: w' => longest plus_exactly (powers times_exactly w0 x n) (moments n T (plus_exactly x T) w')
  end.

Lemma Q2R_plus a b : Q2R (plus_exactly a b) = a + b.
Proof. unfold plus_exactly. rewrite (Qeq_eqR _ _ (Qred_correct _)). apply Q2R_plus. Qed.

Lemma Q2R_times a b : Q2R (times_exactly a b) = a * b.
Proof. unfold times_exactly. rewrite (Qeq_eqR _ _ (Qred_correct _)). apply Q2R_mult. Qed.

Lemma map_longest_Q p q : map Q2R (longest plus_exactly p q) = longest Rplus (map Q2R p) (map Q2R q).
Proof. revert q; induction p as [|a p IH]; intros [|b q]; simpl; trivial. now rewrite IH, Q2R_plus. Qed.

Lemma map_powers_Q w x n : map Q2R (powers times_exactly w x n) = powers Rmult (Q2R w) (Q2R x) n.
Proof. revert w; induction n as [|n IH]; intros w; simpl; trivial. now rewrite IH, Q2R_times. Qed.

Lemma horner_moments n (T x : Q) w p h :
  (length p <= n)%nat ->
  horner (contract Rplus Rmult (map Q2R (moments n T x w)) (two_variables 0 Rplus p)) h =
  shifts T w (fun y => horner p (y + h)) x.
Proof.
  intros H. revert x; induction w as [|w0 w IH]; intros x; [easy|].
  cbn [moments shifts]. rewrite map_longest_Q, horner_contract_longest, map_powers_Q.
  rewrite horner_contract_powers by now rewrite length_two_variables.
  now rewrite IH, Q2R_plus, horner2_two_variables.
Qed.
