(** Derivatives of any order from formulas: Taylor arithmetic on real numbers.

    [tower n f a]: f = a 0, and a k = f^(k) / k! for k < n. Each operation on functions is a recurrence on such
    coefficients, which Checker.v evaluates with intervals. *)

Set Warnings "-ambiguous-paths".
From Coq Require Import Reals List Lra Lia.
From Coquelicot Require Import Coquelicot.
From Interval Require Import Real.Taylor.
Import ListNotations.
Open Scope R_scope.

Definition coefficients := nat -> R -> R.

Definition tower (n : nat) (f : R -> R) (a : coefficients) : Prop :=
  (forall t, a 0%nat t = f t) /\
  forall k, (S k < n)%nat -> forall t, is_derive (a k) t (INR (S k) * a (S k) t).

(** * Cauchy products *)

Definition tail {A} (a : nat -> A) : nat -> A := fun i => a (S i).
Definition at_ (a : coefficients) (t : R) : nat -> R := fun i => a i t.

(** sum_i a_i l_i *)
Fixpoint dots (a : nat -> R) (l : list R) : R :=
  match l with
  | [] => 0
  | y :: l' => a 0%nat * y + dots (tail a) l'
  end.

(** [b_k; ...; b_0] *)
Fixpoint prefix (b : nat -> R) (k : nat) : list R :=
  match k with
  | 0%nat => [b 0%nat]
  | S k' => b k :: prefix b k'
  end.

Definition cauchy (a b : nat -> R) (k : nat) : R := dots a (prefix b k).

(** Coefficients of the derivative. *)
Definition slope (a : nat -> R) : nat -> R := fun i => INR (S i) * a (S i).

Lemma dots_ext (a b : nat -> R) l : (forall i, (i < length l)%nat -> a i = b i) -> dots a l = dots b l.
Proof.
  revert a b; induction l as [|y l IH]; intros a b H; simpl; [easy|].
  rewrite (H 0%nat) by (simpl; lia). rewrite (IH (tail a) (tail b)); [easy|].
  intros i Hi. apply H. simpl; lia.
Qed.

Lemma dots_plus a b l : dots (fun i => a i + b i) l = dots a l + dots b l.
Proof.
  revert a b; induction l as [|y l IH]; intros a b; simpl; [lra|].
  change (tail (fun i => a i + b i)) with (fun i => tail a i + tail b i). rewrite IH. ring.
Qed.

Lemma length_prefix b k : length (prefix b k) = S k.
Proof. induction k; simpl; congruence. Qed.

Lemma cauchy_S a b k : cauchy a b (S k) = a 0%nat * b (S k) + cauchy (tail a) b k.
Proof. easy. Qed.

Lemma cauchy_plus a a' b k : cauchy (fun i => a i + a' i) b k = cauchy a b k + cauchy a' b k.
Proof. apply dots_plus. Qed.

Lemma cauchy_ext a a' b b' k :
  (forall i, (i <= k)%nat -> a i = a' i) -> (forall i, (i <= k)%nat -> b i = b' i) -> cauchy a b k = cauchy a' b' k.
Proof.
  intros Ha Hb. unfold cauchy.
  assert (prefix b k = prefix b' k) as <-.
  { clear Ha. induction k; simpl; [now rewrite Hb|]. rewrite Hb by lia. rewrite IHk; [easy|]. intros; apply Hb; lia. }
  apply dots_ext. intros i. rewrite length_prefix. intros. apply Ha. lia.
Qed.

(** Leibniz' rule. *)
Lemma cauchy_slope a b k :
  cauchy (slope a) b k + cauchy a (slope b) k = INR (S k) * cauchy a b (S k).
Proof.
  revert a; induction k as [|k IH]; intros a.
  - unfold cauchy, slope, tail; simpl; unfold tail. ring.
  - rewrite 2!cauchy_S, (cauchy_S a b (S k)).
    rewrite (cauchy_ext (tail (slope a)) (fun i => slope (tail a) i + tail (tail a) i) b b);
      [|intros; unfold tail, slope; rewrite (S_INR (S i)); ring|easy].
    rewrite cauchy_plus.
    replace (slope a 0%nat * b (S k) + (cauchy (slope (tail a)) b k + cauchy (tail (tail a)) b k) +
       (a 0%nat * slope b (S k) + cauchy (tail a) (slope b) k))
      with (slope a 0%nat * b (S k) + cauchy (tail (tail a)) b k + a 0%nat * slope b (S k) +
       (cauchy (slope (tail a)) b k + cauchy (tail a) (slope b) k)) by ring.
    rewrite IH, (S_INR (S k)), (cauchy_S (tail a) b k). unfold slope, tail. rewrite (S_INR (S k)). simpl (INR 1). ring.
Qed.

Lemma cauchy_derive (a b da db : coefficients) k t :
  (forall i, (i <= k)%nat -> is_derive (a i) t (da i t)) -> (forall i, (i <= k)%nat -> is_derive (b i) t (db i t)) ->
  is_derive (fun t => cauchy (at_ a t) (at_ b t) k) t
    (cauchy (at_ da t) (at_ b t) k + cauchy (at_ a t) (at_ db t) k).
Proof.
  revert a da; induction k as [|k IH]; intros a da Ha Hb.
  - unfold cauchy, at_; simpl.
    apply (is_derive_ext (fun t => a 0%nat t * b 0%nat t)); [intros; unfold Hierarchy.plus; simpl; ring|].
    replace (da 0%nat t * b 0%nat t + 0 + (a 0%nat t * db 0%nat t + 0))
      with (da 0%nat t * b 0%nat t + a 0%nat t * db 0%nat t) by ring.
    apply (is_derive_mult (a 0%nat) (b 0%nat)); auto. intros; apply Rmult_comm.
  - apply (is_derive_ext (fun t => a 0%nat t * b (S k) t + cauchy (at_ (tail a) t) (at_ b t) k)); [easy|].
    rewrite 2!cauchy_S.
    replace (at_ da t 0%nat * at_ b t (S k) + cauchy (tail (at_ da t)) (at_ b t) k +
       (at_ a t 0%nat * at_ db t (S k) + cauchy (tail (at_ a t)) (at_ db t) k))
      with ((da 0%nat t * b (S k) t + a 0%nat t * db (S k) t) +
       (cauchy (at_ (tail da) t) (at_ b t) k + cauchy (at_ (tail a) t) (at_ db t) k))
      by (unfold at_, tail; ring).
    apply (is_derive_plus (fun t => a 0%nat t * b (S k) t)).
    + apply (is_derive_mult (a 0%nat) (b (S k))); [apply Ha; lia|apply Hb; lia|intros; apply Rmult_comm].
    + apply IH; intros; unfold tail; [apply Ha|apply Hb]; lia.
Qed.

(** * Operations *)

Definition constants (c : R) : coefficients := fun k _ => match k with 0%nat => c | _ => 0 end.
Definition variable : coefficients := fun k t => match k with 0%nat => t | 1%nat => 1 | _ => 0 end.
Definition sums (a b : coefficients) : coefficients := fun k t => a k t + b k t.
Definition multiples (c : R) (a : coefficients) : coefficients := fun k t => c * a k t.
Definition shifted (s : R) (a : coefficients) : coefficients := fun k t => a k (t - s).
Definition products (a b : coefficients) : coefficients := fun k t => cauchy (at_ a t) (at_ b t) k.

(** [e_k; ...; e_0] with e' = a' e. *)
Fixpoint exp_prefix (a : nat -> R) (k : nat) : list R :=
  match k with
  | 0%nat => [exp (a 0%nat)]
  | S k' => let l := exp_prefix a k' in / INR k * dots (slope a) l :: l
  end.
Definition exponentials (a : coefficients) : coefficients := fun k t => hd 0 (exp_prefix (at_ a t) k).

(** Coefficients of cos (w t) and sin (w t). *)
Fixpoint cosines_sines (w : R) (k : nat) (t : R) : R * R :=
  match k with
  | 0%nat => (cos (w * t), sin (w * t))
  | S k' => let (c, s) := cosines_sines w k' t in (- (/ INR k * (w * s)), / INR k * (w * c))
  end.
Definition cosines (w : R) : coefficients := fun k t => fst (cosines_sines w k t).

Lemma tower_constants n c : tower n (fun _ => c) (constants c).
Proof.
  split; [easy|]. intros k _ t. simpl constants. rewrite Rmult_0_r.
  destruct k; apply (is_derive_const (K := R_AbsRing) (V := R_NormedModule)).
Qed.

Lemma tower_variable n : tower n (fun t => t) variable.
Proof.
  split; [easy|]. intros [|k] _ t; simpl variable.
  - replace (INR 1 * 1) with 1 by (simpl; ring). apply (is_derive_id (K := R_AbsRing)).
  - rewrite Rmult_0_r. destruct k; simpl; apply (is_derive_const (K := R_AbsRing) (V := R_NormedModule)).
Qed.

Lemma tower_sums n f g a b : tower n f a -> tower n g b -> tower n (fun t => f t + g t) (sums a b).
Proof.
  intros [A0 A] [B0 B]. split; [intros; unfold sums; now rewrite A0, B0|].
  intros k Hk t. unfold sums. rewrite Rmult_plus_distr_l. apply (is_derive_plus (a k) (b k)); auto.
Qed.

Lemma tower_multiples n c f a : tower n f a -> tower n (fun t => c * f t) (multiples c a).
Proof.
  intros [A0 A]. split; [intros; unfold multiples; now rewrite A0|].
  intros k Hk t. unfold multiples. replace (INR (S k) * (c * a (S k) t)) with (c * (INR (S k) * a (S k) t)) by ring.
  apply (is_derive_scal (a k)); auto.
Qed.

Lemma tower_shifted n s f a : tower n f a -> tower n (fun t => f (t - s)) (shifted s a).
Proof.
  intros [A0 A]. split; [intros; unfold shifted; now rewrite A0|].
  intros k Hk t. unfold shifted.
  replace (INR (S k) * a (S k) (t - s)) with (1 * (INR (S k) * a (S k) (t - s))) by ring.
  apply (is_derive_comp (a k) (fun t => t - s)); auto.
  auto_derive; [easy|ring].
Qed.

Lemma tower_products n f g a b : tower n f a -> tower n g b -> tower n (fun t => f t * g t) (products a b).
Proof.
  intros [A0 A] [B0 B]. split.
  - intros. unfold products, cauchy, at_. simpl. rewrite A0, B0. ring.
  - intros k Hk t. unfold products. rewrite <- cauchy_slope.
    apply (cauchy_derive a b (fun i t => INR (S i) * a (S i) t) (fun i t => INR (S i) * b (S i) t));
      intros; [apply A|apply B]; lia.
Qed.

Lemma exp_prefix_prefix a t k : exp_prefix (at_ a t) k = prefix (at_ (exponentials a) t) k.
Proof.
  induction k as [|k IH]; [easy|].
  change (prefix (at_ (exponentials a) t) (S k))
    with (hd 0 (exp_prefix (at_ a t) (S k)) :: prefix (at_ (exponentials a) t) k).
  rewrite <- IH. easy.
Qed.

Lemma exponentials_S a k t :
  exponentials a (S k) t = / INR (S k) * cauchy (slope (at_ a t)) (at_ (exponentials a) t) k.
Proof. unfold cauchy. rewrite <- exp_prefix_prefix. easy. Qed.

Lemma tower_exponentials n f a : tower n f a -> tower n (fun t => exp (f t)) (exponentials a).
Proof.
  intros [A0 A]. split; [intros; unfold exponentials, at_; simpl; now rewrite A0|].
  intros k. induction k as [k IH] using (well_founded_induction Wf_nat.lt_wf). intros Hk t.
  destruct k as [|k].
  - apply (is_derive_ext (fun t => exp (a 0%nat t))); [easy|].
    rewrite exponentials_S.
    assert (E : INR 1 * (/ INR 1 * cauchy (slope (at_ a t)) (at_ (exponentials a) t) 0) = INR 1 * a 1%nat t * exp (a 0%nat t)).
    { change (INR 1 * (/ INR 1 * (INR 1 * a 1%nat t * exp (a 0%nat t) + 0)) = INR 1 * a 1%nat t * exp (a 0%nat t)). simpl (INR 1). field. }
    rewrite E.
    apply (is_derive_comp exp (a 0%nat)); [apply is_derive_exp|]. apply (A 0%nat). lia.
  - apply (is_derive_ext (fun t => / INR (S k) * cauchy (slope (at_ a t)) (at_ (exponentials a) t) k));
      [intros; now rewrite exponentials_S|].
    rewrite exponentials_S.
    assert (N0 : forall j, INR (S j) <> 0) by (intros; apply not_0_INR; lia).
    replace (INR (S (S k)) * (/ INR (S (S k)) * cauchy (slope (at_ a t)) (at_ (exponentials a) t) (S k)))
      with (/ INR (S k) * (INR (S k) * cauchy (slope (at_ a t)) (at_ (exponentials a) t) (S k))) by (field; auto).
    apply (is_derive_scal (fun t => cauchy (slope (at_ a t)) (at_ (exponentials a) t) k)).
    rewrite <- cauchy_slope.
    apply (cauchy_derive (fun i t => slope (at_ a t) i) (exponentials a)
      (fun i t => slope (slope (at_ a t)) i) (fun i t => slope (at_ (exponentials a) t) i)).
    + intros i Hi. unfold slope, at_.
      apply (is_derive_scal (a (S i))). apply A. lia.
    + intros i Hi. unfold slope, at_. apply IH; lia.
Qed.

Lemma cosines_sines_derive w k t :
  is_derive (fun t => fst (cosines_sines w k t)) t (- (w * snd (cosines_sines w k t))) /\
  is_derive (fun t => snd (cosines_sines w k t)) t (w * fst (cosines_sines w k t)).
Proof.
  revert t; induction k as [|k IH]; intros t.
  - simpl. split; auto_derive; trivial; ring.
  - assert (N0 : INR (S k) <> 0) by (apply not_0_INR; lia).
    destruct (IH t) as [Hc Hs]. split.
    + apply (is_derive_ext (fun t => (- (/ INR (S k) * w)) * snd (cosines_sines w k t))).
      { intros s. cbn [cosines_sines]. destruct (cosines_sines w k s) as [c' s']. cbn [fst snd]. change (@eq R (- (/ INR (S k) * w) * s') (- (/ INR (S k) * (w * s')))). ring. }
      cbn [cosines_sines]. destruct (cosines_sines w k t) as [c s]; cbn [fst snd] in *.
      replace (- (w * (/ INR (S k) * (w * c)))) with (- (/ INR (S k) * w) * (w * c)) by ring.
      now apply (is_derive_scal (fun t => snd (cosines_sines w k t))).
    + apply (is_derive_ext (fun t => (/ INR (S k) * w) * fst (cosines_sines w k t))).
      { intros s. cbn [cosines_sines]. destruct (cosines_sines w k s) as [c' s']. cbn [fst snd]. change (@eq R (/ INR (S k) * w * c') (/ INR (S k) * (w * c'))). ring. }
      cbn [cosines_sines]. destruct (cosines_sines w k t) as [c s]; cbn [fst snd] in *.
      replace (w * (- (/ INR (S k) * (w * s)))) with (/ INR (S k) * w * (- (w * s))) by ring.
      now apply (is_derive_scal (fun t => fst (cosines_sines w k t))).
Qed.

Lemma tower_cosines n w : tower n (fun t => cos (w * t)) (cosines w).
Proof.
  split; [easy|]. intros k _ t. unfold cosines.
  replace (INR (S k) * fst (cosines_sines w (S k) t)) with (- (w * snd (cosines_sines w k t))).
  - apply cosines_sines_derive.
  - cbn [cosines_sines]. destruct (cosines_sines w k t) as [c s]; cbn [fst snd].
    field. apply not_0_INR; lia.
Qed.

Lemma tower_ext n f g a : (forall t, f t = g t) -> tower n f a -> tower n g a.
Proof. intros E [A0 A]. split; [intros; now rewrite A0|easy]. Qed.

(** * Taylor's theorem, with Lagrange's remainder *)

(** sum_(k < n) a_k(m) d^k, by Horner's rule. *)
Fixpoint horner (p : list R) (d : R) : R :=
  match p with
  | [] => 0
  | c :: p' => c + d * horner p' d
  end.

Definition at_point (a : coefficients) (m : R) (n : nat) : list R := map (fun k => a k m) (seq 0 n).

Lemma horner_app p q d : horner (p ++ q) d = horner p d + d ^ length p * horner q d.
Proof. induction p as [|c p IH]; simpl; [ring|]. rewrite IH. ring. Qed.

Lemma taylor n f a m d :
  tower (S (S n)) f a ->
  exists y, Rmin m (m + d) <= y <= Rmax m (m + d) /\ f (m + d) = horner (at_point a m (S n)) d + a (S n) y * d ^ S n.
Proof.
  intros [A0 A].
  set (D := fun k t => INR (fact k) * a k t).
  destruct (Cor_Taylor_Lagrange (Rmin m (m + d)) (Rmax m (m + d)) n D) with (x0 := m) (x := m + d) as (y & H & Hy).
  - intros k y Hk _. apply is_derive_Reals. unfold D.
    replace (INR (fact (S k)) * a (S k) y) with (INR (fact k) * (INR (S k) * a (S k) y)).
    + apply (is_derive_scal (a k)). apply A. lia.
    + change (fact (S k)) with (S k * fact k)%nat. rewrite mult_INR. ring.
  - split; [apply Rmin_l|apply Rmax_l].
  - split; [apply Rmin_r|apply Rmax_r].
  - replace (m + d - m) with d in * by ring.
    assert (F0 : forall k, INR (fact k) <> 0) by (intros; apply INR_fact_neq_0).
    assert (E : sum_f_R0 (fun i => D i m / INR (fact i) * d ^ i) n = horner (at_point a m (S n)) d).
    { clear H. unfold at_point, D. generalize n. intros j. induction j as [|j IH].
      - simpl. field.
      - rewrite seq_S, map_app, horner_app, map_length, seq_length, <- IH, tech5.
        f_equal. simpl map. simpl horner. field. auto. }
    rewrite E in H. unfold D in H at 1 2.
    destruct (Req_dec m (m + d)) as [Z|Z].
    + exists m. split; [split; [apply Rmin_l|apply Rmax_l]|].
      assert (d = 0) as -> by lra. rewrite <- Z. rewrite <- A0. unfold at_point. simpl. ring.
    + exists y. split.
      * specialize (Hy Z). unfold Rmin, Rmax. destruct (Rle_dec m (m + d)); lra.
      * rewrite <- A0. simpl (INR (fact 0)) in H. rewrite Rmult_1_l in H.
        rewrite <- (Rplus_0_r (a 0%nat (m + d))).
        replace (a (S n) y * d ^ S n) with (INR (fact (S n)) * a (S n) y / INR (fact (S n)) * d ^ S n) by (field; auto).
        rewrite <- H. ring.
Qed.

Definition squares : coefficients := fun k t => match k with 0%nat => t * t | 1%nat => 2 * t | 2%nat => 1 | _ => 0 end.

Lemma tower_squares n : tower n (fun t => t * t) squares.
Proof.
  split; [easy|]. intros [|[|[|k]]] _ t; unfold squares.
  - auto_derive; [easy|]. simpl. ring.
  - auto_derive; [easy|]. simpl. ring.
  - rewrite Rmult_0_r. apply (is_derive_const (K := R_AbsRing) (V := R_NormedModule)).
  - rewrite Rmult_0_r. apply (is_derive_const (K := R_AbsRing) (V := R_NormedModule)).
Qed.

(** * Matern kernels: kappa(r) = psi(lambda |r|), a smooth function for each sign of r *)

Definition psi (q y : R) : R := (1 + y + q * (y * y)) * exp (- y).

Lemma grows_from_zero (f df : R -> R) x :
  f 0 = 0 -> (forall t, is_derive f t (df t)) -> (forall t, 0 <= t -> 0 <= df t) -> 0 <= x -> 0 <= f x.
Proof.
  intros F0 D P Hx. destruct (MVT_gen f 0 x df) as (c & Hc & E).
  - intros t _. apply D.
  - intros t _. apply derivable_continuous_pt. exists (df t). apply is_derive_Reals, D.
  - rewrite Rmin_left, Rmax_right in Hc by easy. rewrite F0 in E.
    assert (0 <= df c) by now apply P. nra.
Qed.

(** psi(x) - psi(-x), where the two signs differ, is of third or fifth order. *)
Lemma odd_part_3 x : 0 <= x -> 0 <= psi 0 x - psi 0 (- x) <= 2 / 3 * x ^ 3 * exp x.
Proof.
  intros Hx.
  assert (X : forall t, 0 <= t -> 0 <= exp t - exp (- t)).
  { intros t Ht. destruct (Rle_lt_or_eq_dec 0 t Ht) as [L|<-]; [|rewrite ?Ropp_0; lra].
    pose proof (exp_increasing (- t) t). lra. }
  split.
  - apply (grows_from_zero (fun x => psi 0 x - psi 0 (- x)) (fun x => x * (exp x - exp (- x)))); trivial.
    + rewrite ?Ropp_0. ring.
    + intros t. unfold psi. auto_derive; [easy|]. rewrite Ropp_involutive. ring.
    + intros t Ht. apply Rmult_le_pos; auto.
  - enough (0 <= 2 / 3 * x ^ 3 * exp x - (psi 0 x - psi 0 (- x))) by lra.
    apply (grows_from_zero (fun x => 2 / 3 * x ^ 3 * exp x - (psi 0 x - psi 0 (- x)))
      (fun x => x * ((2 * x + 2 / 3 * x ^ 2 - 1) * exp x + exp (- x)))); trivial.
    + unfold psi. rewrite ?Ropp_0. ring.
    + intros t. unfold psi. auto_derive; [easy|]. rewrite Ropp_involutive. simpl. field.
    + intros t Ht. apply Rmult_le_pos; [easy|].
      apply (grows_from_zero (fun x => (2 * x + 2 / 3 * x ^ 2 - 1) * exp x + exp (- x))
        (fun x => (10 / 3 * x + 2 / 3 * x ^ 2) * exp x + (exp x - exp (- x)))); trivial.
      * rewrite ?Ropp_0, exp_0. ring.
      * intros s. auto_derive; [easy|]. simpl. field.
      * intros s Hs. pose proof (exp_pos s). pose proof (X s Hs).
        assert (0 <= 10 / 3 * s + 2 / 3 * s ^ 2) by (simpl; nra). nra.
Qed.

Lemma odd_part_5 x : 0 <= x -> 0 <= psi (1 / 3) (- x) - psi (1 / 3) x <= 2 / 45 * x ^ 5 * exp x.
Proof.
  intros Hx.
  assert (D : forall t, is_derive (fun x => psi (1 / 3) (- x) - psi (1 / 3) x) t (t / 3 * (psi 0 t - psi 0 (- t)))).
  { intros t. unfold psi. auto_derive; [easy|]. rewrite Ropp_involutive. field. }
  split.
  - apply (grows_from_zero _ _ x) with (2 := D); trivial.
    + rewrite ?Ropp_0. ring.
    + intros t Ht. apply Rmult_le_pos; [lra|]. now apply odd_part_3.
  - enough (0 <= 2 / 45 * x ^ 5 * exp x - (psi (1 / 3) (- x) - psi (1 / 3) x)) by lra.
    apply (grows_from_zero (fun x => 2 / 45 * x ^ 5 * exp x - (psi (1 / 3) (- x) - psi (1 / 3) x))
      (fun t => 2 / 9 * t ^ 4 * exp t + 2 / 45 * t ^ 5 * exp t - t / 3 * (psi 0 t - psi 0 (- t)))); trivial.
    + rewrite ?Ropp_0. ring.
    + intros t. apply (is_derive_minus (fun x => 2 / 45 * x ^ 5 * exp x)); [|apply D].
      auto_derive; [easy|]. simpl. field.
    + intros t Ht. pose proof (odd_part_3 t Ht) as [_ O]. pose proof (exp_pos t).
      assert (0 <= t ^ 5) by now apply pow_le.
      assert (t / 3 * (psi 0 t - psi 0 (- t)) <= t / 3 * (2 / 3 * t ^ 3 * exp t)) by (apply Rmult_le_compat_l; lra).
      replace (t / 3 * (2 / 3 * t ^ 3 * exp t)) with (2 / 9 * t ^ 4 * exp t) in * by (simpl; field). nra.
Qed.

Lemma psi_decays q y : 0 <= q <= 1 / 3 -> 0 <= y -> 0 <= psi q y <= 3 * exp (- (y / 2)).
Proof.
  intros Hq Hy. unfold psi. pose proof (exp_pos (- y)). pose proof (exp_pos (- (y / 2))). pose proof (exp_pos (y / 2)).
  assert (S : 0 <= y * y) by nra. assert (S' : 0 <= q * (y * y)) by (apply Rmult_le_pos; lra).
  assert (S2 : q * (y * y) <= 1 / 3 * (y * y)) by (apply Rmult_le_compat_r; lra). split; [nra|].
  assert (B : 1 + y + q * (y * y) <= 3 * exp (y / 2)).
  { enough (0 <= exp (y / 2) - (1 + y / 2 + y * y / 8)) by lra.
    apply (grows_from_zero (fun y => exp (y / 2) - (1 + y / 2 + y * y / 8)) (fun y => (exp (y / 2) - (1 + y / 2)) / 2)); trivial.
    - unfold Rdiv. rewrite ?Rmult_0_l, exp_0. ring.
    - intros t. auto_derive; [easy|]. unfold Rdiv. field.
    - intros t _. pose proof (exp_ineq1_le (t / 2)). lra. }
  replace (- y) with (- (y / 2) + - (y / 2)) by field. rewrite exp_plus.
  replace (3 * exp (- (y / 2))) with (3 * exp (y / 2) * (exp (- (y / 2)) * exp (- (y / 2)))).
  - apply Rmult_le_compat_r; nra.
  - rewrite <- (Rmult_1_r (3 * exp (- (y / 2)))), <- exp_0.
    replace 0 with (y / 2 + - (y / 2)) at 1 by ring. rewrite exp_plus. ring.
Qed.
