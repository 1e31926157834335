(** Disturbed systems: bounds of the errors e(k + 1) = F e(k) + d(k), for all disturbances d(k) in a set.

    Vectors and matrices are functions of indices; only the first n indices count. *)

From Coq Require Import QArith Qreals Reals List Lra Lia.
From Trackably Require Import Statement.
Import ListNotations.
Open Scope R_scope.

Fixpoint sum (n : nat) (f : nat -> R) : R :=
  match n with
  | O => 0
  | S n' => f 0%nat + sum n' (fun i => f (S i))
  end.

Lemma sum_ext n f g : (forall i, (i < n)%nat -> f i = g i) -> sum n f = sum n g.
Proof.
  revert f g; induction n as [|n IH]; simpl; intros f g H; [easy|].
  rewrite (H 0%nat) by lia. f_equal. apply IH. intros. apply H. lia.
Qed.

Lemma sum_plus n f g : sum n (fun i => f i + g i) = sum n f + sum n g.
Proof. revert f g; induction n as [|n IH]; simpl; intros; [ring|]. rewrite IH. ring. Qed.

Lemma sum_scale n c f : sum n (fun i => c * f i) = c * sum n f.
Proof. revert f; induction n as [|n IH]; simpl; intros; [ring|]. rewrite IH. ring. Qed.

Lemma sum_zero n : sum n (fun _ => 0) = 0.
Proof. induction n as [|n IH]; simpl; [easy|]. rewrite IH. ring. Qed.

Lemma sum_le n f g : (forall i, (i < n)%nat -> f i <= g i) -> sum n f <= sum n g.
Proof.
  revert f g; induction n as [|n IH]; simpl; intros f g H; [lra|].
  apply Rplus_le_compat; [apply H; lia|]. apply IH. intros. apply H. lia.
Qed.

Lemma sum_abs n f : Rabs (sum n f) <= sum n (fun i => Rabs (f i)).
Proof.
  revert f; induction n as [|n IH]; simpl; intros f; [rewrite Rabs_R0; lra|].
  pose proof (Rabs_triang (f 0%nat) (sum n (fun i => f (S i)))). pose proof (IH (fun i => f (S i))). simpl in *. lra.
Qed.

Lemma sum_swap n m f : sum n (fun i => sum m (fun j => f i j)) = sum m (fun j => sum n (fun i => f i j)).
Proof.
  revert f; induction n as [|n IH]; simpl; intros f; [now rewrite sum_zero|].
  rewrite (IH (fun i => f (S i))), <- sum_plus. easy.
Qed.

Lemma sum_split n k f : sum (n + k) f = sum n f + sum k (fun i => f (n + i)%nat).
Proof.
  revert f; induction n as [|n IH]; intros f; simpl; [now rewrite Rplus_0_l|]. rewrite (IH (fun i => f (S i))), Rplus_assoc. easy.
Qed.

Lemma sum_nonneg n f : (forall i, 0 <= f i) -> 0 <= sum n f.
Proof. intros H. rewrite <- (sum_zero n). apply sum_le. auto. Qed.

Definition vector := nat -> R.
Definition matrix := nat -> vector.

Definition product (n : nat) (r v : vector) : R := sum n (fun i => r i * v i).
Definition through (n : nat) (r : vector) (M : matrix) : vector := fun j => sum n (fun i => r i * M i j).
Definition image (n : nat) (M : matrix) (v : vector) : vector := fun i => product n (M i) v.

Lemma product_through n m r M v : product m (through n r M) v = product n r (image m M v).
Proof.
  unfold product, through, image, product.
  transitivity (sum m (fun j => sum n (fun i => r i * M i j * v j))).
  - apply sum_ext. intros j _. rewrite Rmult_comm, <- sum_scale. apply sum_ext. intros. ring.
  - rewrite sum_swap. apply sum_ext. intros i _. rewrite <- sum_scale. apply sum_ext. intros. ring.
Qed.

Lemma product_plus n r v w : product n r (fun i => v i + w i) = product n r v + product n r w.
Proof. unfold product. rewrite <- sum_plus. apply sum_ext. intros. ring. Qed.

Lemma product_scale n r c v : product n r (fun i => c * v i) = c * product n r v.
Proof. unfold product. rewrite <- sum_scale. apply sum_ext. intros. ring. Qed.

Lemma product_ext n r v w : (forall i, (i < n)%nat -> v i = w i) -> product n r v = product n r w.
Proof. intros H. apply sum_ext. intros i Hi. now rewrite H. Qed.

Section Errors.

Variables (n : nat) (F : matrix).

(** r F^k *)
Fixpoint iterated (k : nat) (r : vector) : vector :=
  match k with
  | O => r
  | S k' => iterated k' (through n r F)
  end.

Lemma iterated_plus i k r : iterated (i + k) r = iterated k (iterated i r).
Proof. revert r; induction i as [|i IH]; intros r; simpl; [easy|]. apply IH. Qed.

Lemma iterated_S k r : iterated (S k) r = through n (iterated k r) F.
Proof. rewrite <- Nat.add_1_r, iterated_plus. easy. Qed.

Lemma errors_bounded (size : vector -> R) (e d : nat -> vector) :
  (forall i, (i < n)%nat -> e 0%nat i = 0) ->
  (forall k i, (i < n)%nat -> e (S k) i = product n (F i) (e k) + d k i) ->
  (forall k r, Rabs (product n r (d k)) <= size r) ->
  forall k r, Rabs (product n r (e k)) <= sum k (fun i => size (iterated i r)).
Proof.
  intros H0 HS Hd. induction k as [|k IH]; intros r; simpl.
  - rewrite (product_ext n r (e 0%nat) (fun _ => 0 * 0)) by (intros; rewrite H0 by easy; ring).
    rewrite product_scale, Rmult_0_l, Rabs_R0. lra.
  - rewrite (product_ext n r _ (fun i => image n F (e k) i + d k i)) by (intros; now apply HS).
    rewrite product_plus, <- product_through.
    pose proof (Rabs_triang (product n (through n r F) (e k)) (product n r (d k))).
    pose proof (IH (through n r F)). pose proof (Hd k r). lra.
Qed.

(** The largest value on the box |x_j| <= p_j. *)
Variable p : vector.
Definition reach (r : vector) : R := sum n (fun j => Rabs (r j) * p j).

Lemma reach_contracts s a :
  (forall j, 0 <= p j) -> (forall i, (i < n)%nat -> reach (iterated s (F i)) <= a * p i) ->
  forall r, reach (iterated (S s) r) <= a * reach r.
Proof.
  intros Hp H r.
  assert (L : forall k r j, iterated (S k) r j = sum n (fun i => r i * iterated k (F i) j)).
  { intros k. induction k as [|k IH]; intros r' j; [easy|].
    rewrite iterated_S. unfold through.
    rewrite (sum_ext n _ (fun l => sum n (fun i => r' i * iterated k (F i) l * F l j)))
      by (intros; rewrite IH, Rmult_comm, <- sum_scale; apply sum_ext; intros; ring).
    rewrite sum_swap. apply sum_ext. intros i _. rewrite iterated_S. unfold through.
    rewrite <- sum_scale. apply sum_ext. intros. ring. }
  unfold reach at 1.
  apply Rle_trans with (sum n (fun j => sum n (fun i => Rabs (r i) * (Rabs (iterated s (F i) j) * p j)))).
  - apply sum_le. intros j _. rewrite L.
    apply Rle_trans with (sum n (fun i => Rabs (r i * iterated s (F i) j)) * p j).
    + apply Rmult_le_compat_r; [easy|]. apply sum_abs.
    + rewrite Rmult_comm, <- sum_scale. apply Req_le, sum_ext. intros. rewrite Rabs_mult. ring.
  - rewrite sum_swap. unfold reach. rewrite <- sum_scale. apply sum_le. intros i Hi.
    rewrite sum_scale. fold (reach (iterated s (F i))).
    replace (a * (Rabs (r i) * p i)) with (Rabs (r i) * (a * p i)) by ring.
    apply Rmult_le_compat_l; [apply Rabs_pos|]. now apply H.
Qed.

Lemma sum_of_sizes (size : vector -> R) (N s : nat) a :
  (forall j, 0 <= p j) -> a < 1 -> (forall r, 0 <= size r <= reach r) ->
  (forall r, reach (iterated s r) <= a * reach r) ->
  forall k r, sum k (fun i => size (iterated i r)) <=
    sum N (fun i => size (iterated i r)) + sum s (fun i => reach (iterated i (iterated N r))) / (1 - a).
Proof.
  intros Hp Ha Hs Hc k r.
  assert (R0 : forall r, 0 <= reach r) by (intros q; specialize (Hs q); lra).
  assert (T : forall q, sum k (fun i => reach (iterated i q)) <= sum s (fun i => reach (iterated i q)) / (1 - a)).
  { intros q. set (Sk := sum k _).
    assert (E : Sk <= sum s (fun i => reach (iterated i q)) + a * Sk).
    { apply Rle_trans with (sum (s + k) (fun i => reach (iterated i q))).
      - rewrite Nat.add_comm, sum_split. fold Sk.
        assert (0 <= sum s (fun i => reach (iterated (k + i) q))) by (apply sum_nonneg; auto). lra.
      - rewrite sum_split. apply Rplus_le_compat_l. unfold Sk. rewrite <- sum_scale. apply sum_le. intros i _.
        rewrite Nat.add_comm, iterated_plus. apply Hc. }
    apply Rmult_le_reg_r with (1 - a); [lra|]. unfold Rdiv. rewrite Rmult_assoc, Rinv_l by lra. lra. }
  apply Rle_trans with (sum (N + k) (fun i => size (iterated i r))).
  - rewrite Nat.add_comm, sum_split.
    assert (0 <= sum N (fun i => size (iterated (k + i) r))) by (apply sum_nonneg; intros; apply Hs). lra.
  - rewrite sum_split. apply Rplus_le_compat_l.
    apply Rle_trans with (sum k (fun i => reach (iterated i (iterated N r)))); [|apply T].
    apply sum_le. intros i _. rewrite iterated_plus. apply Hs.
Qed.

End Errors.

(** * Sets of disturbances *)

Definition vec (l : list Q) : vector := fun i => Q2R (nth i l 0%Q).
Definition mat (M : list (list Q)) : matrix := fun i => vec (nth i M []).

Definition vectors (Z : zonotope) : list vector := map vec (middle Z :: generators Z).

(** The largest |r w| of all w = sum of s_j y_j with |s_j| <= 1. *)
Fixpoint size (n : nat) (Y : list vector) (r : vector) : R :=
  match Y with
  | [] => 0
  | y :: Y' => Rabs (product n r y) + size n Y' r
  end.

Fixpoint extent (Y : list vector) (i : nat) : R :=
  match Y with
  | [] => 0
  | y :: Y' => Rabs (y i) + extent Y' i
  end.

Lemma size_nonneg n Y r : 0 <= size n Y r.
Proof. induction Y as [|y Y IH]; simpl; [lra|]. pose proof (Rabs_pos (product n r y)). lra. Qed.

Lemma size_app n Y Z r : size n (Y ++ Z) r = size n Y r + size n Z r.
Proof. induction Y as [|y Y IH]; simpl; [ring|]. rewrite IH. ring. Qed.

Lemma size_image n A Y r : size n (map (image n A) Y) r = size n Y (through n r A).
Proof. induction Y as [|y Y IH]; simpl; [easy|]. now rewrite IH, product_through. Qed.

Lemma size_reach n Y p r : (forall i, (i < n)%nat -> extent Y i <= p i) -> size n Y r <= reach n p r.
Proof.
  intros H. apply Rle_trans with (sum n (fun i => Rabs (r i) * extent Y i)).
  - clear H. induction Y as [|y Y IH]; simpl.
    + apply sum_nonneg. intros. rewrite Rmult_0_r. lra.
    + rewrite (sum_ext n _ (fun i => Rabs (r i * y i) + Rabs (r i) * extent Y i))
        by (intros; rewrite Rabs_mult; ring).
      rewrite sum_plus. apply Rplus_le_compat; [apply sum_abs|easy].
  - apply sum_le. intros i Hi. apply Rmult_le_compat_l; [apply Rabs_pos|auto].
Qed.

Lemma in_zonotope_size n Z w r : in_zonotope Z w -> Rabs (product n r w) <= size n (vectors Z) r.
Proof.
  intros (s & Hs & E). rewrite (product_ext n r w (fun i => vec (middle Z) i + mixture s (generators Z) i)) by (intros; apply E).
  rewrite product_plus. unfold vectors. cbn [map size].
  eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat_l. clear E.
  revert s Hs; induction (generators Z) as [|g gs IH]; intros s Hs; cbn [mixture map size].
  - rewrite (product_ext n r _ (fun _ => 0 * 0)) by (intros; ring).
    rewrite product_scale, Rmult_0_l, Rabs_R0. lra.
  - rewrite (product_ext n r _ (fun i => s 0%nat * vec g i + mixture (fun j => s (S j)) gs i)) by (intros; easy).
    rewrite product_plus, product_scale. eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat.
    + rewrite Rabs_mult. rewrite <- (Rmult_1_l (Rabs (product n r (vec g)))) at 2.
      apply Rmult_le_compat_r; [apply Rabs_pos|]. apply Rabs_le. apply Hs.
    + apply IH. intros; apply Hs.
Qed.

Lemma dot_product n row v : (length row <= n)%nat -> dot row v = product n (vec row) (fun i => nth i v 0).
Proof.
  assert (Z : forall n f, (forall i, f i = 0) -> 0 = sum n f).
  { intros k f H. rewrite <- (sum_zero k). apply sum_ext. auto. }
  unfold product, vec. revert row v; induction n as [|n IH]; intros [|a row] v H; simpl in H; try lia; try easy.
  - apply Z. intros [|i]; unfold Q2R; simpl; ring.
  - destruct v as [|y v]; [apply Z; intros [|i]; simpl; ring|]. cbn [dot sum nth]. f_equal. apply IH. lia.
Qed.

(** * Runs beside a reference *)

Definition no_equation : equation := {| of_states := []; of_inputs := []; constant := 0 |}.

Section Runs.

Variables (c : certificate) (d : disturbance).
Let n := length (states c).
Let m := length (inputs c).
Definition A_ : matrix := fun i => vec (of_states (nth i (system c) no_equation)).
Definition B_ : matrix := fun i => vec (of_inputs (nth i (system c) no_equation)).
Definition K_ : matrix := mat (feedback d).
Definition F_ : matrix := fun i j => A_ i j + through m (B_ i) K_ j.
Definition Y_ : list vector :=
  vectors (pushes d) ++ vectors (noise d) ++ map (image n A_) (vectors (noise d)).

Definition fits : bool :=
  Nat.eqb (length (system c)) n &&
  forallb (fun e => Nat.leb (length (of_states e)) n && Nat.leb (length (of_inputs e)) m) (system c) &&
  forallb (fun r => Nat.leb (length r) n) (feedback d).

Lemma run_bounds t0 xs us w v (limit : vector -> R) :
  fits = true -> holds c -> runs c d t0 xs us w v ->
  (forall k, in_zonotope (pushes d) (w k)) -> (forall k, in_zonotope (noise d) (v k)) ->
  (forall k r, sum k (fun i => size n Y_ (iterated n F_ i r)) <= limit r) ->
  forall k, let t := t0 + INR k * sampling_time c in
  (forall row, (length row <= n)%nat ->
     Rabs (dot row (xs k) - dot row (x c t)) <= limit (vec row) + size n (vectors (noise d)) (vec row)) /\
  (forall row, (length row <= m)%nat ->
     Rabs (dot row (us k) - dot row (u c t)) <= limit (through m (vec row) K_)).
Proof.
  unfold fits. intros [[L1 L2]%andb_prop L3]%andb_prop [Hsys _] (R0 & Ru & Rx) Hw Hv Hlim.
  apply Nat.eqb_eq in L1. rewrite forallb_forall in L2, L3.
  set (t := fun k => t0 + INR k * sampling_time c).
  set (off := fun k i => nth i (xs k) 0 + v k i - nth i (x c (t k)) 0).
  assert (HA : forall i, (length (of_states (nth i (system c) no_equation)) <= n)%nat /\
    (length (of_inputs (nth i (system c) no_equation)) <= m)%nat).
  { intros i. destruct (nth_in_or_default i (system c) no_equation) as [I|E]; [|rewrite E; simpl; lia].
    specialize (L2 _ I). apply andb_prop in L2 as [H1 H2]. split; now apply Nat.leb_le. }
  assert (HK : forall i, (length (nth i (feedback d) []) <= n)%nat).
  { intros i. destruct (nth_in_or_default i (feedback d) []) as [I|E]; [|rewrite E; simpl; lia].
    apply Nat.leb_le. now apply L3. }
  assert (U : forall k j, nth j (us k) 0 - nth j (u c (t k)) 0 = product n (K_ j) (off k)).
  { intros k j. rewrite Ru. fold (t k). fold n. change (fun i => nth i (xs k) 0 + v k i - nth i (x c (t k)) 0) with (off k).
    rewrite (dot_product n) by apply HK. unfold K_, mat.
    rewrite (product_ext n _ _ (off k)); [ring|]. intros i Hi.
    rewrite (nth_indep _ 0 (off k 0%nat)) by now rewrite map_length, seq_length.
    now rewrite map_nth, seq_nth. }
  assert (Succ : forall X V i, (i < n)%nat -> nth i (successor (system c) X V) 0 =
    product n (A_ i) (fun j => nth j X 0) + product m (B_ i) (fun j => nth j V 0) + constant (nth i (system c) no_equation)).
  { intros X V i Hi. unfold successor.
    set (f := fun e : equation => dot (of_states e) X + dot (of_inputs e) V + constant e).
    rewrite (nth_indep _ 0 (f no_equation)) by (rewrite map_length; lia).
    rewrite map_nth. unfold f. now rewrite (dot_product n), (dot_product m) by apply HA. }
  assert (Next : forall k i, (i < n)%nat -> off (S k) i =
    product n (F_ i) (off k) + (w k i + v (S k) i + -1 * product n (A_ i) (v k))).
  { intros k i Hi. unfold off at 1. rewrite Rx.
    replace (t (S k)) with (t k + sampling_time c) by (unfold t; rewrite S_INR; ring).
    rewrite Hsys, !Succ by easy.
    assert (PF : product n (F_ i) (off k) = product n (A_ i) (off k) + product m (B_ i) (image n K_ (off k))).
    { rewrite <- product_through. unfold product, F_. rewrite <- sum_plus. apply sum_ext. intros. ring. }
    rewrite PF.
    rewrite (product_ext m (B_ i) (fun j => nth j (us k) 0) (fun j => nth j (u c (t k)) 0 + image n K_ (off k) j)).
    2: { intros j _. unfold image. rewrite <- U. ring. }
    rewrite (product_ext n (A_ i) (fun j => nth j (xs k) 0) (fun j => (nth j (x c (t k)) 0 + off k j) + -1 * v k j)).
    2: { intros j _. unfold off. ring. }
    rewrite !product_plus, product_scale. ring. }
  assert (Off : forall k r, Rabs (product n r (off k)) <= limit r).
  { intros k r. eapply Rle_trans; [|apply Hlim].
    apply (errors_bounded n F_ (size n Y_) off (fun k i => w k i + v (S k) i + -1 * product n (A_ i) (v k))).
    - intros i _. apply R0.
    - apply Next.
    - intros j q. change (fun i => w j i + v (S j) i + -1 * product n (A_ i) (v j))
        with (fun i => (fun i => w j i + v (S j) i) i + (fun i => -1 * image n A_ (v j) i) i).
      rewrite product_plus, product_plus, product_scale, <- product_through.
      unfold Y_. rewrite !size_app, size_image.
      pose proof (in_zonotope_size n _ _ q (Hw j)). pose proof (in_zonotope_size n _ _ q (Hv (S j))).
      pose proof (in_zonotope_size n _ _ (through n q A_) (Hv j)).
      pose proof (Rabs_triang (product n q (w j) + product n q (v (S j))) (-1 * product n (through n q A_) (v j))).
      pose proof (Rabs_triang (product n q (w j)) (product n q (v (S j)))).
      rewrite Rabs_mult, (Rabs_left (-1)) in * by lra. lra. }
  intros k. cbn zeta. fold (t k). split; intros row Hrow.
  - rewrite !(dot_product n) by easy.
    replace (product n (vec row) (fun i => nth i (xs k) 0) - product n (vec row) (fun i => nth i (x c (t k)) 0))
      with (product n (vec row) (off k) + -1 * product n (vec row) (v k)).
    + eapply Rle_trans; [apply Rabs_triang|]. apply Rplus_le_compat; [apply Off|].
      rewrite Rabs_mult, (Rabs_left (-1)) by lra. pose proof (in_zonotope_size n _ _ (vec row) (Hv k)). lra.
    + rewrite (product_ext n (vec row) (fun i => nth i (xs k) 0) (fun i => (nth i (x c (t k)) 0 + off k i) + -1 * v k i))
        by (intros; unfold off; ring).
      rewrite !product_plus, product_scale. ring.
  - rewrite !(dot_product m) by easy.
    rewrite (product_ext m (vec row) (fun i => nth i (us k) 0) (fun i => nth i (u c (t k)) 0 + image n K_ (off k) i))
      by (intros; unfold image; rewrite <- U; ring).
    rewrite product_plus, <- product_through.
    match goal with |- Rabs ?a <= _ => replace a with (product n (through m (vec row) K_) (off k)) by ring end. apply Off.
Qed.

End Runs.
