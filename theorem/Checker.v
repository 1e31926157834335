(** The checker, in interval arithmetic, computed by [vm_compute]: what it accepts [holds] ([check_sound]).

    On a box (an interval of times) with middle m, each signal is a Taylor polynomial about m plus a remainder, with a
    coefficient that is enclosed over the whole box. Weighted sums of shifted signals are formed by exact moments of the
    shifts: terms that cancel, as in an acceleration, cancel before rounding. A box that does not decide is halved. *)

From Coq Require Import ZArith QArith Qreals Reals List Bool Lra Lia.
From Interval Require Import Real.Xreal Float.Basic Float.Sig Interval.Interval Interval.Float Interval.Float_full.
From Trackably Require Import Statement Jets Polynomials Forms Disturbance.
Import ListNotations.
Open Scope R_scope.

Module Checker (F : FloatOps with Definition radix := radix2 with Definition sensible_format := true).
Module I := FloatIntervalFull F.

Definition prec := F.PtoP 53.
Definition interval := I.type.
Definition mem (x : R) (X : interval) : Prop := contains (I.convert X) (Xreal x).
Notation "x ∈ X" := (mem x X) (at level 70).

Definition iadd : interval -> interval -> interval := I.add prec.
Definition imul : interval -> interval -> interval := I.mul prec.
Definition idiv : interval -> interval -> interval := I.div prec.
Definition isub : interval -> interval -> interval := I.sub prec.
Definition ofZ : Z -> interval := I.fromZ prec.
Definition ofQ (q : Q) : interval := idiv (ofZ (Qnum q)) (ofZ (Zpos (Qden q))).
Definition ofnat (n : nat) : interval := ofZ (Z.of_nat n).
Definition o : interval := I.zero.

(** * Arithmetic *)

Lemma add_mem x y X Y : x ∈ X -> y ∈ Y -> x + y ∈ iadd X Y.
Proof. exact (I.add_correct prec X Y (Xreal x) (Xreal y)). Qed.
Lemma sub_mem x y X Y : x ∈ X -> y ∈ Y -> x - y ∈ isub X Y.
Proof. exact (I.sub_correct prec X Y (Xreal x) (Xreal y)). Qed.
Lemma mul_mem x y X Y : x ∈ X -> y ∈ Y -> x * y ∈ imul X Y.
Proof. exact (I.mul_correct prec X Y (Xreal x) (Xreal y)). Qed.
Lemma neg_mem x X : x ∈ X -> - x ∈ I.neg X.
Proof. exact (I.neg_correct X (Xreal x)). Qed.
Lemma sqr_mem x X : x ∈ X -> x * x ∈ I.sqr prec X.
Proof. exact (I.sqr_correct prec X (Xreal x)). Qed.
Lemma exp_mem x X : x ∈ X -> exp x ∈ I.exp prec X.
Proof. exact (I.exp_correct prec X (Xreal x)). Qed.
Lemma cos_mem x X : x ∈ X -> cos x ∈ I.cos prec X.
Proof. exact (I.cos_correct prec X (Xreal x)). Qed.
Lemma sin_mem x X : x ∈ X -> sin x ∈ I.sin prec X.
Proof. exact (I.sin_correct prec X (Xreal x)). Qed.
Lemma zero_mem : 0 ∈ o.
Proof. unfold mem, o. rewrite I.zero_correct. simpl. lra. Qed.
Lemma zero_mem_inv x : x ∈ o -> x = 0.
Proof. unfold mem, o. rewrite I.zero_correct. simpl. lra. Qed.
Lemma ofZ_mem z : IZR z ∈ ofZ z.
Proof. exact (I.fromZ_correct prec z). Qed.
Lemma ofnat_mem n : INR n ∈ ofnat n.
Proof. rewrite INR_IZR_INZ. apply ofZ_mem. Qed.

Lemma div_mem x y X Y : x ∈ X -> y ∈ Y -> x / y ∈ idiv X Y.
Proof.
  intros Hx Hy. pose proof (I.div_correct prec X Y _ _ Hx Hy) as H. unfold mem, idiv. simpl in H.
  unfold Xdiv' in H. destruct (is_zero y); [|easy].
  destruct (I.convert (I.div prec X Y)); easy.
Qed.

Lemma ofQ_mem q : Q2R q ∈ ofQ q.
Proof. apply div_mem; apply ofZ_mem. Qed.

Definition nonnegative (X : interval) : bool :=
  match I.sign_large X with Xgt | Xeq => true | _ => false end.
Definition negative (X : interval) : bool :=
  match I.sign_strict X with Xlt => true | _ => false end.

Lemma nonnegative_mem x X : nonnegative X = true -> x ∈ X -> 0 <= x.
Proof.
  unfold nonnegative. pose proof (I.sign_large_correct X) as H. destruct (I.sign_large X); try easy; intros _ Hx.
  - specialize (H _ Hx). injection H as ->. lra.
  - apply (H _ Hx).
Qed.

Lemma negative_mem x X : negative X = true -> x ∈ X -> x < 0.
Proof.
  unfold negative. pose proof (I.sign_strict_correct X) as H. destruct (I.sign_strict X); try easy; intros _ Hx.
  apply (H _ Hx).
Qed.

Definition midpoint (X : interval) : interval := I.singleton (I.midpoint X).
Lemma midpoint_mem X : exists m, m ∈ midpoint X.
Proof. eexists. apply I.singleton_correct. Qed.

Lemma between_mem x y z X : x ∈ X -> y ∈ X -> Rmin x y <= z <= Rmax x y -> z ∈ X.
Proof.
  intros Hx Hy. unfold Rmin, Rmax. destruct (Rle_dec x y); intros Hz.
  - now apply (contains_connected (I.convert X) x y).
  - now apply (contains_connected (I.convert X) y x).
Qed.

Lemma join_l x X Y : x ∈ X -> x ∈ I.join X Y.
Proof. intros. apply I.join_correct. now left. Qed.
Lemma join_r x X Y : x ∈ Y -> x ∈ I.join X Y.
Proof. intros. apply I.join_correct. now right. Qed.

Fixpoint power (k : nat) (X : interval) : interval :=
  match k with
  | O => ofZ 1
  | S k' => imul X (power k' X)
  end.

Lemma power_mem k t X : t ∈ X -> t ^ k ∈ power k X.
Proof. intros H. induction k; simpl; [apply ofZ_mem|now apply mul_mem]. Qed.

(** * Lists of intervals around lists of numbers *)

Notation "p ⊂ P" := (Forall2 mem p P) (at level 70).

Lemma longest_mem p q P Q : p ⊂ P -> q ⊂ Q -> longest Rplus p q ⊂ longest iadd P Q.
Proof.
  intros Hp. revert q Q. induction Hp as [|a A p P Ha Hp IH]; intros q Q Hq; simpl; [easy|].
  destruct Hq; constructor; auto using add_mem.
Qed.

Lemma scale_mem c C p P : c ∈ C -> p ⊂ P -> map (Rmult c) p ⊂ map (imul C) P.
Proof. intros Hc. induction 1; simpl; constructor; auto using mul_mem. Qed.

Lemma recentred_mem m M p P : m ∈ M -> p ⊂ P -> recentred Rplus Rmult m p ⊂ recentred iadd imul M P.
Proof.
  intros Hm. induction 1; cbn [recentred]; [constructor|].
  apply longest_mem; [now constructor|]. now apply scale_mem.
Qed.

Notation "b ⊏ B" := (Forall2 (Forall2 mem) b B) (at level 70).

Lemma longest2_mem b c B C :
  b ⊏ B -> c ⊏ C -> longest (longest Rplus) b c ⊏ longest (longest iadd) B C.
Proof.
  intros Hb. revert c C. induction Hb as [|a A p P Ha Hp IH]; intros q Q Hq; simpl; [easy|].
  destruct Hq; constructor; auto using longest_mem.
Qed.

Lemma two_variables_mem p P : p ⊂ P -> two_variables 0 Rplus p ⊏ two_variables o iadd P.
Proof.
  induction 1 as [|c C p P Hc Hp IH]; cbn [two_variables]; [constructor|].
  destruct IH as [|q Q b B Hq Hb]; [repeat constructor; easy|].
  assert (E : map (cons 0) b ⊏ map (cons o) B).
  { clear - Hb. induction Hb; simpl; constructor; trivial. constructor; trivial using zero_mem. }
  apply longest2_mem; repeat (constructor; trivial).
Qed.

Lemma contract_mem s S b B : s ⊂ S -> b ⊏ B -> contract Rplus Rmult s b ⊂ contract iadd imul S B.
Proof.
  intros Hs. revert b B. induction Hs as [|x X s S Hx Hs IH]; intros b B Hb; simpl; [constructor|].
  destruct Hb; [constructor|]. apply longest_mem; auto using scale_mem.
Qed.

Lemma ofQ_list l : map Q2R l ⊂ map ofQ l.
Proof. induction l; constructor; auto using ofQ_mem. Qed.

(** * Where a polynomial is nowhere negative *)

(** Enclose sum_i p_i h^i; S encloses h^2. *)
Fixpoint range (p : list interval) (H S : interval) : interval :=
  match p with
  | [] => o
  | [a] => a
  | a :: b :: p' => iadd (iadd a (imul b H)) (imul S (range p' H S))
  end.

Lemma range_mem p P h H S : p ⊂ P -> h ∈ H -> h * h ∈ S -> horner p h ∈ range P H S.
Proof.
  intros Hp Hh Hs.
  enough ((horner p h ∈ range P H S) /\ forall a A, a ∈ A -> horner (a :: p) h ∈ range (A :: P) H S) by easy.
  induction Hp as [|b B p P Hb Hp [IH1 IH2]]; split.
  - apply zero_mem.
  - intros a A Ha. simpl. now replace (a + h * 0) with a by ring.
  - now apply IH2.
  - intros a A Ha. cbn [range horner].
    replace (a + h * (b + h * horner p h)) with (a + b * h + h * h * horner p h) by ring.
    auto using add_mem, mul_mem.
Qed.

Fixpoint polynomial_nonnegative (fuel : nat) (p : list interval) (H : interval) : bool :=
  if nonnegative (range p H (I.sqr prec H)) then true else
  match fuel with
  | O => false
  | S fuel' =>
    let (L, R) := I.bisect H in
    let half X := let m := midpoint X in polynomial_nonnegative fuel' (recentred iadd imul m p) (isub X m) in
    if half L then half R else false
  end.

Lemma polynomial_nonnegative_sound fuel p P h H :
  p ⊂ P -> h ∈ H -> polynomial_nonnegative fuel P H = true -> 0 <= horner p h.
Proof.
  revert p P h H; induction fuel as [|fuel IH]; intros p P h H Hp Hh; cbn [polynomial_nonnegative].
  all: destruct (nonnegative _) eqn:E; [intros _; apply (nonnegative_mem _ _ E); auto using range_mem, sqr_mem|].
  - easy.
  - pose proof (I.bisect_correct H (Xreal h) Hh) as B. destruct (I.bisect H) as [L R]. cbn [fst snd] in B.
    cbv zeta. destruct (polynomial_nonnegative fuel (recentred iadd imul (midpoint L) P) _) eqn:HL; [intros HR|easy].
    assert (G : forall X, h ∈ X ->
      polynomial_nonnegative fuel (recentred iadd imul (midpoint X) P) (isub X (midpoint X)) = true -> 0 <= horner p h).
    { intros X HX C. destruct (midpoint_mem X) as [m Hm].
      replace h with (m + (h - m)) by ring. rewrite <- horner_recentred.
      apply (IH _ _ _ _ (recentred_mem _ _ _ _ Hm Hp) (sub_mem _ _ _ _ HX Hm) C). }
    destruct B as [B|B]; eauto.
Qed.

(** * Jets: enclosures of a function's Taylor coefficients *)

Definition jet := list interval.
Definition coefficient (J : jet) (k : nat) : interval := nth k J o.
Definition around (n : nat) (a : nat -> R) (J : jet) : Prop := forall k, (k < n)%nat -> a k ∈ coefficient J k.

Definition encloses (n : nat) (f : R -> R) (J : interval -> jet) : Prop :=
  exists a, tower n f a /\ forall t X, t ∈ X -> around n (at_ a t) (J X).

Definition jadd : jet -> jet -> jet := longest iadd.
Definition jscale (C : interval) : jet -> jet := map (imul C).

Fixpoint jmul (n : nat) (a b : jet) : jet :=
  match n, a with
  | S n', A :: a' => imul A (hd o b) :: jadd (jscale A (firstn n' (tl b))) (jmul n' a' b)
  | _, _ => []
  end.

Fixpoint jdots (a l : list interval) : interval :=
  match a, l with
  | A :: a', Y :: l' => iadd (imul A Y) (jdots a' l')
  | _, _ => o
  end.

Fixpoint jslope (k : nat) (l : jet) : jet :=
  match l with
  | [] => []
  | A :: l' => imul (ofnat k) A :: jslope (S k) l'
  end.

Fixpoint jexp_prefix (n k : nat) (slope : jet) (l : list interval) : list interval :=
  match n with
  | O => l
  | S n' => jexp_prefix n' (S k) slope (idiv (jdots slope l) (ofnat (S k)) :: l)
  end.

Definition jexp (n : nat) (a : jet) : jet :=
  rev (jexp_prefix (pred n) 0 (jslope 1 (tl a)) [I.exp prec (hd o a)]).

Fixpoint jcos_from (n k : nat) (W C S : interval) : jet :=
  match n with
  | O => []
  | Datatypes.S n' =>
    let K := ofnat (Datatypes.S k) in
    C :: jcos_from n' (Datatypes.S k) W (I.neg (idiv (imul W S) K)) (idiv (imul W C) K)
  end.
Definition jcos (n : nat) (W X : interval) : jet :=
  let Y := imul W X in jcos_from n 0 W (I.cos prec Y) (I.sin prec Y).

Lemma coefficient_nil k : coefficient [] k = o.
Proof. now destruct k. Qed.

Lemma around_nil n a : around n a [] -> forall k, (k < n)%nat -> a k = 0.
Proof. intros H k Hk. apply zero_mem_inv. rewrite <- (coefficient_nil k). now apply H. Qed.

Lemma around_tail n a A l : around (S n) a (A :: l) -> (a 0%nat ∈ A) /\ around n (tail a) l.
Proof.
  intros H. split; [apply (H 0%nat); lia|]. intros k Hk. apply (H (S k)). lia.
Qed.

Lemma around_cons n a A l : a 0%nat ∈ A -> around n (tail a) l -> around (S n) a (A :: l).
Proof. intros HA Hl [|k] Hk; [easy|]. apply Hl. lia. Qed.

Lemma around_le n m a l : (m <= n)%nat -> around n a l -> around m a l.
Proof. intros Hm H k Hk. apply H. lia. Qed.

Lemma around_ext n a b l : (forall k, (k < n)%nat -> a k = b k) -> around n a l -> around n b l.
Proof. intros E H k Hk. rewrite <- E by easy. now apply H. Qed.

Lemma around_add n a b A B : around n a A -> around n b B -> around n (fun k => a k + b k) (jadd A B).
Proof.
  revert a b A B; induction n as [|n IH]; intros a b [|X A] [|Y B] HA HB.
  1-4: intros k Hk; lia.
  - intros k Hk. rewrite (around_nil _ _ HA k Hk), Rplus_0_l. now apply HB.
  - intros k Hk. rewrite (around_nil _ _ HA k Hk), Rplus_0_l. now apply HB.
  - intros k Hk. rewrite (around_nil _ _ HB k Hk), Rplus_0_r. now apply HA.
  - apply around_tail in HA as [HX HA]. apply around_tail in HB as [HY HB].
    apply around_cons; [now apply add_mem|]. now apply (IH (tail a) (tail b)).
Qed.

Lemma around_scale n a A c C : c ∈ C -> around n a A -> around n (fun k => c * a k) (jscale C A).
Proof.
  intros Hc HA k Hk. unfold coefficient, jscale.
  destruct (Nat.lt_ge_cases k (length A)) as [L|L].
  - rewrite (nth_indep _ o (imul C o)) by now rewrite map_length.
    rewrite map_nth. apply mul_mem; [easy|]. now apply HA.
  - rewrite nth_overflow by now rewrite map_length.
    specialize (HA k Hk). unfold coefficient in HA. rewrite nth_overflow in HA by easy.
    apply zero_mem_inv in HA as ->. rewrite Rmult_0_r. apply zero_mem.
Qed.

Lemma around_firstn n a A : around n a A -> around n a (firstn n A).
Proof.
  revert a A; induction n as [|n IH]; intros a [|X A] H; try easy.
  apply around_tail in H as [HX HA]. cbn [firstn]. apply around_cons; [easy|]. now apply IH.
Qed.

Lemma around_tl n a A : around (S n) a A -> (a 0%nat ∈ hd o A) /\ around n (tail a) (tl A).
Proof.
  destruct A as [|X A]; [|apply around_tail].
  intros H. split; [apply (H 0%nat); lia|]. intros k Hk. specialize (H (S k) ltac:(lia)).
  simpl tl. now rewrite coefficient_nil in *.
Qed.

Lemma cauchy_zero a b k : (forall i, (i <= k)%nat -> a i = 0) -> cauchy a b k = 0.
Proof.
  revert a; induction k as [|k IH]; intros a H.
  - unfold cauchy; simpl. rewrite H by lia. ring.
  - rewrite cauchy_S, H, IH by (try lia; intros; apply H; lia). ring.
Qed.

Lemma around_mul n a b A B : around n a A -> around n b B -> around n (cauchy a b) (jmul n A B).
Proof.
  revert a A; induction n as [|n IH]; intros a A HA HB; [intros k Hk; lia|].
  destruct A as [|X A].
  - intros k Hk. rewrite coefficient_nil, cauchy_zero; [apply zero_mem|].
    intros i Hi. apply (around_nil _ _ HA). lia.
  - pose proof (around_le _ n _ _ (Nat.le_succ_diag_r n) HB) as HB'.
    apply around_tail in HA as [HX HA]. apply around_tl in HB as [H0 HB].
    cbn [jmul]. apply around_cons.
    + replace (cauchy a b 0) with (a 0%nat * b 0%nat) by (unfold cauchy; simpl; ring). now apply mul_mem.
    + apply (around_ext _ (fun k => a 0%nat * tail b k + cauchy (tail a) b k)); [easy|].
      apply around_add; [|now apply IH]. apply around_scale; [easy|]. now apply around_firstn.
Qed.

Lemma around_slope n k a A :
  around n a A -> around n (fun i => INR (k + i) * a i) (jslope k A).
Proof.
  revert k a A; induction n as [|n IH]; intros k a A HA; [intros i Hi; lia|].
  destruct A as [|X A].
  - intros i Hi. cbn [jslope]. rewrite (around_nil _ _ HA i Hi), Rmult_0_r, coefficient_nil. apply zero_mem.
  - apply around_tail in HA as [HX HA]. cbn [jslope]. apply around_cons.
    + rewrite Nat.add_0_r. apply mul_mem; [apply ofnat_mem|easy].
    + apply (around_ext _ (fun i => INR (S k + i) * tail a i)); [|now apply IH].
      intros i _. unfold tail. do 2 f_equal. lia.
Qed.

Lemma dots_mem n a A l L : around n a A -> l ⊂ L -> (length l <= n)%nat -> dots a l ∈ jdots A L.
Proof.
  intros HA Hl. revert n a A HA; induction Hl as [|y Y l L Hy Hl IH]; intros n a A HA Hn.
  - destruct A; apply zero_mem.
  - destruct n as [|n]; [simpl in Hn; lia|]. cbn [length] in Hn. destruct A as [|X A].
    + replace (dots a (y :: l)) with 0; [apply zero_mem|].
      rewrite (dots_ext a (fun _ => 0)); [|intros i Hi; apply (around_nil _ _ HA); simpl in Hi; lia].
      clear. induction (y :: l) as [|z l' IH]; [easy|]. simpl. unfold tail. rewrite <- IH. ring.
    + apply around_tail in HA as [HX HA]. cbn [dots jdots].
      apply add_mem; [now apply mul_mem|]. apply (IH n); [easy|lia].
Qed.

Lemma length_exp_prefix a k : length (exp_prefix a k) = S k.
Proof. induction k; simpl in *; congruence. Qed.

Lemma exp_prefix_mem n m k a slope_ l :
  around m (slope a) slope_ -> (n + k <= m)%nat -> exp_prefix a k ⊂ l ->
  exp_prefix a (n + k) ⊂ jexp_prefix n k slope_ l.
Proof.
  intros Hs. revert k l; induction n as [|n IH]; intros k l Hm Hl; [easy|].
  cbn [jexp_prefix]. replace (S n + k)%nat with (n + S k)%nat by lia. apply IH; [lia|].
  cbn [exp_prefix]. constructor; [|easy].
  rewrite Rmult_comm. apply div_mem; [|apply ofnat_mem].
  apply (dots_mem m); [easy|easy|]. rewrite length_exp_prefix. lia.
Qed.

Lemma rev_mem p P : p ⊂ P -> rev p ⊂ rev P.
Proof. induction 1; simpl; [constructor|]. apply Forall2_app; auto. Qed.

Lemma nth_mem p P k : p ⊂ P -> (k < length p)%nat -> nth k p 0 ∈ coefficient P k.
Proof.
  intros H. revert k; induction H as [|a A p P Ha Hp IH]; intros k Hk; simpl in Hk; [lia|].
  destruct k as [|k]; [easy|]. apply IH. lia.
Qed.

Lemma nth_rev_prefix b n k : (k <= n)%nat -> nth k (rev (prefix b n)) 0 = b k.
Proof.
  intros Hk. rewrite rev_nth by (rewrite length_prefix; lia). rewrite length_prefix.
  replace (S n - S k)%nat with (n - k)%nat by lia. revert k Hk; induction n as [|n IH]; intros k Hk.
  - now replace k with 0%nat by lia.
  - destruct (Nat.eq_dec k (S n)) as [->|N]; [now rewrite Nat.sub_diag|].
    replace (S n - k)%nat with (S (n - k)) by lia. apply IH. lia.
Qed.

Lemma around_exp n (a : coefficients) t A :
  around n (at_ a t) A -> around n (at_ (exponentials a) t) (jexp n A).
Proof.
  destruct n as [|n]; intros HA; [intros k Hk; lia|].
  pose proof (around_tl _ _ _ HA) as [H0 HT].
  intros k Hk. unfold jexp. cbn [pred].
  rewrite <- (nth_rev_prefix (at_ (exponentials a) t) n k) by lia.
  apply nth_mem; [|rewrite rev_length, length_prefix; lia].
  apply rev_mem. rewrite <- exp_prefix_prefix. replace n with (n + 0)%nat at 1 by lia.
  apply (exp_prefix_mem n n 0); [|lia|repeat constructor; now apply exp_mem].
  apply (around_ext _ (fun i => INR (1 + i) * tail (at_ a t) i)); [easy|]. now apply around_slope.
Qed.

Lemma around_cos n k w t W C S :
  w ∈ W -> fst (cosines_sines w k t) ∈ C -> snd (cosines_sines w k t) ∈ S ->
  around n (fun i => cosines w (k + i)%nat t) (jcos_from n k W C S).
Proof.
  intros Hw. revert k C S; induction n as [|n IH]; intros k C S HC HS; [intros i Hi; lia|].
  cbn [jcos_from]. apply around_cons; [now rewrite Nat.add_0_r|].
  apply (around_ext _ (fun i => cosines w (Datatypes.S k + i)%nat t)); [intros i _; unfold tail; f_equal; lia|].
  apply IH; cbn [cosines_sines]; destruct (cosines_sines w k t) as [c s]; cbn [fst snd] in *.
  - apply neg_mem. rewrite Rmult_comm. apply div_mem; [now apply mul_mem|apply ofnat_mem].
  - rewrite Rmult_comm. apply div_mem; [now apply mul_mem|apply ofnat_mem].
Qed.

(** * Formulas *)

Lemma encloses_ext n f g J : (forall t, f t = g t) -> encloses n f J -> encloses n g J.
Proof. intros E (a & Ha & H). exists a. split; [now apply (tower_ext n f)|easy]. Qed.

Lemma encloses_constant n c C : c ∈ C -> encloses n (fun _ => c) (fun _ => [C]).
Proof.
  intros Hc. exists (constants c). split; [apply tower_constants|].
  intros t X _ [|k] _; [easy|]. unfold coefficient. simpl. destruct k; apply zero_mem.
Qed.

Lemma encloses_square n : encloses n (fun t => t * t) (fun X => [I.sqr prec X; imul (ofZ 2) X; ofZ 1]).
Proof.
  exists squares. split; [apply tower_squares|].
  intros t X HX [|[|[|k]]] _; unfold coefficient; cbn [nth at_ squares].
  - now apply sqr_mem.
  - apply mul_mem; [apply ofZ_mem|easy].
  - apply ofZ_mem.
  - destruct k; apply zero_mem.
Qed.

Lemma encloses_cos n w W : w ∈ W -> encloses n (fun t => cos (w * t)) (jcos n W).
Proof.
  intros Hw. exists (cosines w). split; [apply tower_cosines|].
  intros t X HX. apply (around_cos n 0); [easy| |]; simpl.
  - apply cos_mem. now apply mul_mem.
  - apply sin_mem. now apply mul_mem.
Qed.

Lemma encloses_add n f g J K : encloses n f J -> encloses n g K ->
  encloses n (fun t => f t + g t) (fun X => jadd (J X) (K X)).
Proof.
  intros (a & Ha & HJ) (b & Hb & HK). exists (sums a b). split; [now apply tower_sums|].
  intros t X HX. apply (around_add n (at_ a t) (at_ b t)); auto.
Qed.

Lemma encloses_scale n c C f J : c ∈ C -> encloses n f J -> encloses n (fun t => c * f t) (fun X => jscale C (J X)).
Proof.
  intros Hc (a & Ha & HJ). exists (multiples c a). split; [now apply tower_multiples|].
  intros t X HX. apply (around_scale n (at_ a t)); auto.
Qed.

Lemma encloses_mul n f g J K : encloses n f J -> encloses n g K ->
  encloses n (fun t => f t * g t) (fun X => jmul n (J X) (K X)).
Proof.
  intros (a & Ha & HJ) (b & Hb & HK). exists (products a b). split; [now apply tower_products|].
  intros t X HX. apply (around_mul n (at_ a t) (at_ b t)); auto.
Qed.

Lemma encloses_exp n f J : encloses n f J -> encloses n (fun t => exp (f t)) (fun X => jexp n (J X)).
Proof.
  intros (a & Ha & HJ). exists (exponentials a). split; [now apply tower_exponentials|].
  intros t X HX. apply around_exp; auto.
Qed.

(** * Kinks: in each box, a function is a smooth one plus an error, which is 0 where there is none *)

Definition error := option interval.
Definition is_error (E : error) (e : R) : Prop := match E with None => e = 0 | Some X => e ∈ X end.
Definition wide (E : error) : interval := match E with None => o | Some X => X end.
Definition with_error (E : error) (X : interval) : interval := match E with None => X | Some Y => iadd Y X end.
Definition eadd (D E : error) : error := match D with None => E | Some X => Some (with_error E X) end.

Lemma wide_mem E e : is_error E e -> e ∈ wide E.
Proof. destruct E; simpl; [easy|]. intros ->. apply zero_mem. Qed.
Lemma with_error_mem E e x X : is_error E e -> x ∈ X -> e + x ∈ with_error E X.
Proof. destruct E; simpl; [apply add_mem|]. intros -> Hx. now rewrite Rplus_0_l. Qed.
Lemma eadd_mem D d E e : is_error D d -> is_error E e -> is_error (eadd D E) (d + e).
Proof.
  destruct D; simpl; intros Hd He; [|now rewrite Hd, Rplus_0_l].
  rewrite Rplus_comm. now apply with_error_mem.
Qed.

Definition local := interval -> error * (interval -> jet).

Definition covers (n : nat) (f : R -> R) (G : local) : Prop := forall B, exists a,
  tower n (a 0%nat) a /\ (forall t, t ∈ B -> is_error (fst (G B)) (f t - a 0%nat t)) /\
  forall t X, t ∈ X -> around n (at_ a t) (snd (G B) X).

Definition smooth_everywhere (J : interval -> jet) : local := fun _ => (None, J).
Definition ladd (G H : local) : local := fun B =>
  let (D, J) := G B in let (E, K) := H B in (eadd D E, fun X => jadd (J X) (K X)).
Definition lscale (C : interval) (G : local) : local := fun B =>
  let (E, J) := G B in (option_map (imul C) E, fun X => jscale C (J X)).
Definition lshift (S : interval) (G : local) : local := fun B =>
  let (E, J) := G (isub B S) in (E, fun X => J (isub X S)).
Definition lmul (n : nat) (G H : local) : local := fun B =>
  let (D, J) := G B in let (E, K) := H B in
  (match D, E with
   | None, None => None
   | _, _ => Some (iadd (imul (coefficient (J B) 0) (wide E)) (imul (wide D) (with_error E (coefficient (K B) 0))))
   end, fun X => jmul n (J X) (K X)).

Lemma covers_smooth n f J : encloses n f J -> covers n f (smooth_everywhere J).
Proof.
  intros (a & [A0 A] & HJ) B. exists a. split; [now split|]. split; [|easy].
  intros t _. simpl. rewrite A0. ring.
Qed.

Lemma covers_ext n f g G : (forall t, f t = g t) -> covers n f G -> covers n g G.
Proof.
  intros E H B. destruct (H B) as (a & Ha & HE & HJ). exists a. split; [easy|]. split; [|easy].
  intros t Ht. rewrite <- E. auto.
Qed.

Lemma covers_add n f g G H : covers n f G -> covers n g H -> covers n (fun t => f t + g t) (ladd G H).
Proof.
  intros HG HH B. destruct (HG B) as (a & Ha & HD & HJ). destruct (HH B) as (b & Hb & HE & HK).
  unfold ladd. destruct (G B) as [D J], (H B) as [E K]. cbn [fst snd] in *.
  exists (sums a b). split; [now apply (tower_sums n (a 0%nat) (b 0%nat))|]. split.
  - intros t Ht. replace (f t + g t - sums a b 0%nat t) with (f t - a 0%nat t + (g t - b 0%nat t)) by (unfold sums; ring).
    apply eadd_mem; auto.
  - intros t X HX. apply (around_add n (at_ a t) (at_ b t)); auto.
Qed.

Lemma covers_scale n c C f G : c ∈ C -> covers n f G -> covers n (fun t => c * f t) (lscale C G).
Proof.
  intros Hc HG B. destruct (HG B) as (a & Ha & HE & HJ). unfold lscale. destruct (G B) as [E J]. cbn [fst snd] in *.
  exists (multiples c a). split; [now apply (tower_multiples n c (a 0%nat))|]. split.
  - intros t Ht. specialize (HE t Ht).
    replace (c * f t - multiples c a 0%nat t) with (c * (f t - a 0%nat t)) by (unfold multiples; ring).
    destruct E; simpl in *; [now apply mul_mem|]. rewrite HE. ring.
  - intros t X HX. apply (around_scale n (at_ a t)); auto.
Qed.

Lemma covers_shift n s S f G : s ∈ S -> covers n f G -> covers n (fun t => f (t - s)) (lshift S G).
Proof.
  intros Hs HG B. destruct (HG (isub B S)) as (a & Ha & HE & HJ). unfold lshift.
  destruct (G (isub B S)) as [E J]. cbn [fst snd] in *.
  exists (shifted s a). split; [now apply (tower_shifted n s (a 0%nat))|]. split.
  - intros t Ht. apply HE. now apply sub_mem.
  - intros t X HX. apply (HJ (t - s)). now apply sub_mem.
Qed.

Lemma covers_mul n f g G H : (0 < n)%nat -> covers n f G -> covers n g H -> covers n (fun t => f t * g t) (lmul n G H).
Proof.
  intros Hn HG HH B. destruct (HG B) as (a & Ha & HD & HJ). destruct (HH B) as (b & Hb & HE & HK).
  unfold lmul. destruct (G B) as [D J], (H B) as [E K]. cbn [fst snd] in *.
  exists (products a b). split.
  { apply (tower_ext n (fun t => a 0%nat t * b 0%nat t)); [|now apply tower_products].
    intros t. unfold products, cauchy, at_. simpl. ring. }
  split.
  - intros t Ht. specialize (HD t Ht). specialize (HE t Ht).
    pose proof (HJ t B Ht 0%nat Hn) as Va. pose proof (HK t B Ht 0%nat Hn) as Vb. unfold at_ in Va, Vb.
    set (d := f t - a 0%nat t) in *. set (e := g t - b 0%nat t) in *.
    replace (f t * g t - products a b 0%nat t) with (a 0%nat t * e + d * (e + b 0%nat t))
      by (unfold products, cauchy, at_, d, e; simpl; ring).
    pose proof (add_mem _ _ _ _ (mul_mem _ _ _ _ Va (wide_mem _ _ HE))
      (mul_mem _ _ _ _ (wide_mem _ _ HD) (with_error_mem _ _ _ _ HE Vb))) as G0.
    destruct D, E; try exact G0. simpl in *. rewrite HD, HE. ring.
  - intros t X HX. apply (around_mul n (at_ a t) (at_ b t)); auto.
Qed.

(** psi (lambda |r|): the branch that the box is on, or that of r >= 0 with an error c x^p times one of [0, exp x]. *)
Definition jpsi (n : nat) (q L X : interval) : jet :=
  let V := [imul L X; L] in
  let P := jadd [ofZ 1] (jadd V (jscale (imul q (I.sqr prec L)) [I.sqr prec X; imul (ofZ 2) X; ofZ 1])) in
  match jmul n P (jexp n (jscale (ofZ (-1)) V)) with
  | [] => []
  | v :: l =>
    (if negb (I.bounded X) && nonnegative (imul L X)
     then imul (imul (ofZ 3) (I.exp prec (I.neg (idiv (imul L X) (ofZ 2))))) (I.join (ofZ 0) (ofZ 1)) else v) :: l
  end.

Definition lpsi (n p : nat) (q c L : interval) : local := fun B =>
  if nonnegative B then (None, jpsi n q L)
  else if nonnegative (I.neg B) then (None, jpsi n q (I.neg L))
  else let X := imul L (I.neg B) in
    (Some (imul (imul c (power p X)) (I.join o (I.exp prec X))), jpsi n q L).

Lemma encloses_jpsi n q q_ l L : 0 <= q <= 1 / 3 -> q ∈ q_ -> l ∈ L -> encloses n (fun r => psi q (l * r)) (jpsi n q_ L).
Proof.
  intros Hq Hq' Hl.
  assert (HV : encloses n (fun r => l * r) (fun X => [imul L X; L])).
  { exists (multiples l variable). split; [apply tower_multiples, tower_variable|].
    intros t X HX [|[|k]] _; unfold coefficient, at_, multiples; cbn [nth variable]; [now apply mul_mem|now rewrite Rmult_1_r|].
    rewrite Rmult_0_r. destruct k; apply zero_mem. }
  assert (HN : encloses n (fun r => (1 + (l * r + q * (l * l) * (r * r))) * exp (-1 * (l * r)))
    (fun X => jmul n (jadd [ofZ 1] (jadd [imul L X; L] (jscale (imul q_ (I.sqr prec L)) [I.sqr prec X; imul (ofZ 2) X; ofZ 1])))
      (jexp n (jscale (ofZ (-1)) [imul L X; L])))).
  { apply encloses_mul.
    - apply encloses_add; [apply (encloses_constant n 1), ofZ_mem|]. apply encloses_add; [easy|].
      apply encloses_scale; [|apply encloses_square]. apply mul_mem; [easy|now apply sqr_mem].
    - apply encloses_exp, encloses_scale; [apply ofZ_mem|easy]. }
  apply (encloses_ext n _ (fun r => psi q (l * r))) in HN; [|intros r; unfold psi; f_equal; [ring|f_equal; ring]].
  destruct HN as (a & [A0 A] & HN). exists a. split; [now split|].
  intros t X HX. specialize (HN t X HX). unfold jpsi. cbv zeta.
  destruct (jmul n _ _) as [|v l0]; [easy|].
  destruct (_ && nonnegative _) eqn:E; [|easy]. apply andb_prop in E as [_ E].
  intros [|k] Hk; [|apply (HN (S k) Hk)]. clear HN. unfold coefficient, at_. cbn [nth]. rewrite A0.
  assert (Y : l * t ∈ imul L X) by now apply mul_mem.
  apply (nonnegative_mem _ _ E) in Y as Y0. pose proof (psi_decays q (l * t) Hq Y0) as D.
  set (m := 3 * exp (- (l * t / 2))) in *. assert (M : 0 < m) by (unfold m; pose proof (exp_pos (- (l * t / 2))); lra).
  replace (psi q (l * t)) with (m * (psi q (l * t) / m)) by (field; lra). apply mul_mem.
  - unfold m. apply mul_mem; [apply ofZ_mem|]. apply exp_mem, neg_mem, div_mem; [easy|apply ofZ_mem].
  - apply (between_mem 0 1); [apply join_l, ofZ_mem|apply join_r, ofZ_mem|].
    rewrite Rmin_left, Rmax_right by lra. split; [apply Rcomplements.Rdiv_le_0_compat; lra|].
    apply Rcomplements.Rle_div_l; lra.
Qed.

Lemma covers_lpsi n p q q_ c c_ l L :
  0 <= q <= 1 / 3 -> q ∈ q_ -> c ∈ c_ -> 0 < l -> l ∈ L ->
  (forall x, 0 <= x -> exists y, 0 <= y <= exp x /\ psi q x - psi q (- x) = c * x ^ p * y) ->
  covers n (fun r => psi q (l * Rabs r)) (lpsi n p q_ c_ L).
Proof.
  intros Hq Hq' Hc Hl HL Hodd B. unfold lpsi.
  assert (Plus : exists a, tower n (a 0%nat) a /\ (forall t, a 0%nat t = psi q (l * t)) /\
      forall t X, t ∈ X -> around n (at_ a t) (jpsi n q_ L X)).
  { destruct (encloses_jpsi n q q_ l L Hq Hq' HL) as (a & [A0 A] & HJ). exists a. split; [now split|]. now split. }
  destruct (nonnegative B) eqn:E1; [|destruct (nonnegative (I.neg B)) eqn:E2].
  - destruct Plus as (a & Ha & A0 & HJ). exists a. split; [easy|]. split; [|easy].
    intros t Ht. apply (nonnegative_mem _ _ E1) in Ht. simpl. rewrite A0, Rabs_pos_eq by easy. ring.
  - destruct (encloses_jpsi n q q_ (- l) (I.neg L) Hq Hq' (neg_mem _ _ HL)) as (a & [A0 A] & HJ).
    exists a. split; [now split|]. split; [|easy].
    intros t Ht. apply neg_mem, (nonnegative_mem _ _ E2) in Ht. simpl. rewrite A0, Rabs_left1 by lra.
    replace (l * - t) with (- l * t) by ring. ring.
  - destruct Plus as (a & Ha & A0 & HJ). exists a. split; [easy|]. split; [|easy].
    intros t Ht. cbn [fst is_error]. rewrite A0.
    set (x := l * - t). assert (Hx : x ∈ imul L (I.neg B)) by (apply mul_mem; [easy|now apply neg_mem]).
    assert (exists y, (y ∈ I.join o (I.exp prec (imul L (I.neg B)))) /\ psi q (l * Rabs t) - psi q (l * t) = c * x ^ p * y)
      as (y & Hy & ->).
    { destruct (Rle_dec 0 t) as [T|T].
      - exists 0. split; [apply join_l, zero_mem|]. rewrite Rabs_pos_eq by easy. ring.
      - destruct (Hodd x) as (y & Hy & Ey); [unfold x; nra|]. exists y. split.
        + apply (between_mem 0 (exp x)); [apply join_l, zero_mem|apply join_r; now apply exp_mem|].
          rewrite Rmin_left, Rmax_right; [easy| |]; apply Rlt_le, exp_pos.
        + rewrite Rabs_left1 by lra. rewrite <- Ey. unfold x. now replace (- (l * - t)) with (l * t) by ring. }
    apply mul_mem; [|easy]. apply mul_mem; [easy|now apply power_mem].
Qed.

(** * Kernels *)

(** kappa with n coefficients. What depends on hyperparameters alone is computed once. *)
Fixpoint local_of (n : nat) (k : kernel) : local :=
  match k with
  | SquaredExponential s l =>
    let s2 := I.sqr prec (ofQ s) in
    let c := idiv (ofZ (-1)) (imul (ofZ 2) (I.sqr prec (ofQ l))) in
    smooth_everywhere (fun X => jscale s2 (jexp n (jscale c [I.sqr prec X; imul (ofZ 2) X; ofZ 1])))
  | Periodic s l p =>
    let s2 := I.sqr prec (ofQ s) in
    let c := idiv (ofZ 1) (I.sqr prec (ofQ l)) in
    let w := idiv (imul (ofZ 2) (I.pi prec)) (ofQ p) in
    let one := [ofZ (-1)] in
    smooth_everywhere (fun X => jscale s2 (jexp n (jscale c (jadd (jcos n w X) one))))
  | Matern32 s l =>
    let L := idiv (I.sqrt prec (ofZ 3)) (ofQ l) in
    lscale (I.sqr prec (ofQ s)) (lpsi n 3 o (ofQ (2 # 3)) L)
  | Matern52 s l =>
    let L := idiv (I.sqrt prec (ofZ 5)) (ofQ l) in
    lscale (I.sqr prec (ofQ s)) (lpsi n 5 (ofQ (1 # 3)) (ofQ (-2 # 45)) L)
  | Sum a b => let G := local_of n a in let H := local_of n b in ladd G H
  | Product a b => let G := local_of n a in let H := local_of n b in lmul n G H
  end.

(** Whether length scales are positive where that is needed. *)
Fixpoint proper (k : kernel) : bool :=
  match k with
  | SquaredExponential _ _ | Periodic _ _ _ => true
  | Matern32 _ l | Matern52 _ l => negb (Qle_bool l 0)
  | Sum a b | Product a b => proper a && proper b
  end.

Lemma sqrt_mem x X : 0 <= x -> x ∈ X -> sqrt x ∈ I.sqrt prec X.
Proof.
  intros Hx HX. pose proof (I.sqrt_correct prec X (Xreal x) HX) as H. unfold mem. simpl in H.
  unfold Xsqrt' in H. destruct (is_negative_spec x); [lra|easy].
Qed.

Lemma proper_positive l : negb (Qle_bool l 0) = true -> 0 < Q2R l.
Proof.
  intros H. rewrite <- Q2R_0. apply Qlt_Rlt, Qnot_le_lt. intros L. apply Qle_bool_iff in L. now rewrite L in H.
Qed.

Lemma local_of_sound n k : (0 < n)%nat -> proper k = true -> covers n (kappa k) (local_of n k).
Proof.
  intros Hn. induction k as [s l|s l p|s l|s l|a IHa b IHb|a IHa b IHb]; cbn [proper local_of kappa].
  - intros _. apply covers_smooth, (encloses_ext n (fun r => (s * s) * exp (-1 / (2 * (l * l)) * (r * r)))).
    { intros r. simpl. rewrite !Rmult_1_r. do 2 f_equal. unfold Rdiv. ring. }
    apply encloses_scale; [apply sqr_mem, ofQ_mem|]. apply encloses_exp, encloses_scale; [|apply encloses_square].
    apply div_mem; [apply ofZ_mem|]. apply mul_mem; [apply ofZ_mem|]. apply sqr_mem, ofQ_mem.
  - intros _. apply covers_smooth, (encloses_ext n (fun r => (s * s) * exp (1 / (l * l) * (cos (2 * PI / p * r) + -1)))).
    { intros r. simpl. rewrite !Rmult_1_r. do 2 f_equal.
      replace (2 * PI / p * r) with (2 * (PI * r / p)) by (unfold Rdiv; ring).
      rewrite cos_2a_sin. unfold Rdiv. ring. }
    apply encloses_scale; [apply sqr_mem, ofQ_mem|]. apply encloses_exp, encloses_scale.
    + apply div_mem; [apply ofZ_mem|]. apply sqr_mem, ofQ_mem.
    + apply encloses_add; [|apply encloses_constant, ofZ_mem]. apply encloses_cos.
      apply div_mem; [|apply ofQ_mem]. apply mul_mem; [apply ofZ_mem|]. apply I.pi_correct.
  - intros Hl%proper_positive. apply (covers_ext n (fun r => (s * s) * psi 0 (sqrt 3 / l * Rabs r))).
    { intros r. unfold psi. replace (sqrt 3 / l * Rabs r) with (sqrt 3 * Rabs r / l) by (unfold Rdiv; ring). simpl. ring. }
    apply covers_scale; [apply sqr_mem, ofQ_mem|]. apply (covers_lpsi n 3 0 _ (2 # 3)%Q); auto using zero_mem, ofQ_mem.
    + lra.
    + apply Rdiv_lt_0_compat; [apply sqrt_lt_R0; lra|easy].
    + apply div_mem; [|apply ofQ_mem]. apply sqrt_mem; [lra|apply ofZ_mem].
    + intros x Hx. pose proof (odd_part_3 x Hx) as H. replace (Q2R (2 # 3)) with (2 / 3) by (unfold Q2R; simpl; field).
      destruct (Rle_lt_or_eq_dec 0 x Hx) as [P|<-].
      * assert (0 < x ^ 3) by now apply pow_lt. exists ((psi 0 x - psi 0 (- x)) / (2 / 3 * x ^ 3)). split; [|field; lra].
        split; [apply Rcomplements.Rdiv_le_0_compat; lra|]. apply Rcomplements.Rle_div_l; lra.
      * exists 0. rewrite exp_0, Ropp_0. split; [lra|ring].
  - intros Hl%proper_positive. apply (covers_ext n (fun r => (s * s) * psi (1 / 3) (sqrt 5 / l * Rabs r))).
    { intros r. unfold psi. replace (sqrt 5 / l * Rabs r) with (sqrt 5 * Rabs r / l) by (unfold Rdiv; ring). simpl.
      rewrite !Rmult_1_r. do 2 f_equal. f_equal. unfold Rdiv. ring. }
    apply covers_scale; [apply sqr_mem, ofQ_mem|]. apply (covers_lpsi n 5 (1 / 3) _ (-2 # 45)%Q); auto using ofQ_mem.
    + lra.
    + replace (1 / 3) with (Q2R (1 # 3)) by (unfold Q2R; simpl; field). apply ofQ_mem.
    + apply Rdiv_lt_0_compat; [apply sqrt_lt_R0; lra|easy].
    + apply div_mem; [|apply ofQ_mem]. apply sqrt_mem; [lra|apply ofZ_mem].
    + intros x Hx. pose proof (odd_part_5 x Hx) as H. replace (Q2R (-2 # 45)) with (- (2 / 45)) by (unfold Q2R; simpl; field).
      destruct (Rle_lt_or_eq_dec 0 x Hx) as [P|<-].
      * assert (0 < x ^ 5) by now apply pow_lt. exists ((psi (1 / 3) (- x) - psi (1 / 3) x) / (2 / 45 * x ^ 5)).
        split; [|field; lra].
        split; [apply Rcomplements.Rdiv_le_0_compat; lra|]. apply Rcomplements.Rle_div_l; lra.
      * exists 0. rewrite exp_0, Ropp_0. split; [lra|ring].
  - intros [Ha Hb]%andb_prop. apply covers_add; auto.
  - intros [Ha Hb]%andb_prop. apply covers_mul; auto.
Qed.

(** * Signals: deviations e from their means *)

Fixpoint local_of_terms (K : local) (l : list (interval * interval)) : local :=
  match l with
  | [] => smooth_everywhere (fun _ => [])
  | (w, c) :: l' => let G := local_of_terms K l' in ladd (lscale w (lshift c K)) G
  end.

Definition local_of_signal (n : nat) (z : signal) : local :=
  let K := local_of n (prior z) in
  let l := map (fun i => (ofQ (weight i), ofQ (centre i))) (terms z) in
  local_of_terms K l.

Lemma local_of_signal_sound n z :
  (0 < n)%nat -> proper (prior z) = true -> covers n (deviation_of z) (local_of_signal n z).
Proof.
  intros Hn Hs. apply (local_of_sound n _ Hn) in Hs. unfold deviation_of, local_of_signal.
  induction (terms z) as [|i l IH]; cbn [deviation map local_of_terms].
  - apply covers_smooth. exists (constants 0). split; [apply tower_constants|].
    intros t X _ k _. rewrite coefficient_nil. unfold at_, constants. destruct k; apply zero_mem.
  - apply covers_add; [|exact IH]. apply covers_scale; [apply ofQ_mem|].
    apply (covers_shift n _ _ (kappa (prior z))); [apply ofQ_mem|easy].
Qed.

(** * Rows: trajectories with their numbers as intervals *)

Record prepared := { rest_ : interval; weights_ : list (list interval); moments_ : list (list interval) }.

Definition prepare (n : nat) (T : Q) (zs : list signal) (f : trajectory) : prepared :=
  {| rest_ := ofQ (rest zs f);
     weights_ := map (map ofQ) (weights f);
     moments_ := map (fun w => map ofQ (moments n T 0 w)) (weights f) |}.

Section Rows.

Variables (n : nat) (T : Q).
Let T_ := ofQ T.

(** Values without any expansion: at a single time, or at all times from some time on. *)
Fixpoint plain_shifts (W : list interval) (G : local) (X : interval) : interval :=
  match W with
  | [] => o
  | w :: W' =>
    let (E, J) := G X in
    iadd (imul w (with_error E (coefficient (J X) 0))) (plain_shifts W' G (iadd X T_))
  end.

Fixpoint plain_sum (Ws : list (list interval)) (Gs : list local) (X : interval) : interval :=
  match Ws, Gs with
  | W :: Ws', G :: Gs' => iadd (plain_shifts W G X) (plain_sum Ws' Gs' X)
  | _, _ => o
  end.

Definition plain (Gs : list local) (X : interval) (p : prepared) : interval :=
  iadd (rest_ p) (plain_sum (weights_ p) Gs X).

Definition cover_signals (zs : list signal) (Gs : list local) : Prop :=
  Forall2 (fun z G => covers (S (S n)) (deviation_of z) G) zs Gs.

Lemma plain_mem zs Gs f t X :
  cover_signals zs Gs -> t ∈ X -> trajectory_at T zs f t ∈ plain Gs X (prepare (S n) T zs f).
Proof.
  intros HG HX. rewrite at_rest. unfold plain, prepare. cbn [rest_ weights_].
  apply add_mem; [apply ofQ_mem|]. generalize (weights f). intros ws. revert ws.
  induction HG as [|z G zs Gs HG _ IH]; intros [|w ws]; cbn [map plain_sum sum_of_deviations];
    try apply zero_mem.
  apply add_mem; [|apply IH].
  clear IH. revert t X HX. induction w as [|b w IH]; intros t X HX; cbn [map plain_shifts shifts]; [apply zero_mem|].
  destruct (HG X) as (a & _ & HE & HJ). destruct (G X) as [E J]. cbn [fst snd] in *.
  apply add_mem; [|apply IH; now apply add_mem, ofQ_mem].
  apply mul_mem; [apply ofQ_mem|].
  replace (deviation_of z t) with (deviation_of z t - a 0%nat t + a 0%nat t) by ring.
  apply with_error_mem; [now apply HE|]. apply (HJ t X HX 0%nat). lia.
Qed.

(** * Boxes *)

(** t, t + T, ... for k shifts *)
Fixpoint hull (k : nat) (X : interval) : interval :=
  match k with
  | O => X
  | S k' => I.join X (hull k' (iadd X T_))
  end.

Fixpoint along (w : list Q) (P : R -> Prop) (t : R) : Prop :=
  match w with
  | [] => True
  | _ :: w' => P t /\ along w' P (t + T)
  end.

Lemma along_impl w (P Q : R -> Prop) t : (forall t, P t -> Q t) -> along w P t -> along w Q t.
Proof. intros H. revert t; induction w; simpl; intuition. Qed.

Lemma hull_mem k w t X : (length w <= k)%nat -> t ∈ X -> along w (fun y => y ∈ hull k X) t.
Proof.
  revert w t X; induction k as [|k IH]; intros [|b w] t X Hw HX; simpl in Hw |- *; try easy.
  split; [now apply join_l|].
  apply (along_impl _ (fun y => y ∈ hull k (iadd X T_))); [intros; now apply join_r|].
  apply IH; [lia|]. now apply add_mem, ofQ_mem.
Qed.

Fixpoint remainder (W : list interval) (E : error) (C Y : interval) : interval :=
  match W with
  | [] => o
  | w :: W' => iadd (imul w (with_error E (imul C (power (S n) Y)))) (remainder W' E C (iadd Y T_))
  end.

Lemma remainder_mem (f : R -> R) a m box E C w h (d : R) D :
  tower (S (S n)) (a 0%nat) a -> m ∈ box -> (forall y, y ∈ box -> is_error E (f y - a 0%nat y)) ->
  (forall y, y ∈ box -> a (S n) y ∈ C) -> along w (fun y => y ∈ box) (m + (d + h)) -> d + h ∈ D ->
  exists r, r ∈ remainder (map ofQ w) E C D /\
    shifts T w f (m + (d + h)) = shifts T w (fun y => horner (at_point a m (S n)) (y + h)) d + r.
Proof.
  intros Ha Hm HE HC. revert d D; induction w as [|b w IH]; intros d D Hw HD; cbn [shifts map remainder along] in *.
  - exists 0. split; [apply zero_mem|ring].
  - destruct Hw as [H0 Hw].
    replace (m + (d + h) + T) with (m + (d + T + h)) in * by ring.
    destruct (IH (d + T) (iadd D T_) Hw) as (r & Hr & Er).
    { replace (d + T + h) with (d + h + T) by ring. now apply add_mem, ofQ_mem. }
    destruct (taylor n _ a m (d + h) Ha) as (y & Hy & Ey).
    exists (b * (f (m + (d + h)) - a 0%nat (m + (d + h)) + a (S n) y * (d + h) ^ S n) + r). split.
    + apply add_mem; [|easy]. apply mul_mem; [apply ofQ_mem|]. apply with_error_mem; [now apply HE|].
      apply mul_mem; [|now apply power_mem]. apply HC. now apply (between_mem m (m + (d + h))).
    + rewrite Er, Ey. ring.
Qed.

(** A signal on a box: its Taylor polynomial at d + h as a polynomial in d and h, its error, its next coefficient. *)
Record model := { taylor_ : list (list interval); error_ : error; next_ : interval }.
Definition model_of (mid box : interval) (G : local) : model :=
  let (E, J) := G box in
  let P := J mid in
  {| taylor_ := two_variables o iadd (map (coefficient P) (seq 0 (S n)));
     error_ := E; next_ := coefficient (J box) (S n) |}.

Fixpoint sum_of_models (H : interval) (Ws Ms : list (list interval)) (ms : list model) : list interval :=
  match Ws, Ms, ms with
  | W :: Ws', M :: Ms', m :: ms' =>
    longest iadd (longest iadd [remainder W (error_ m) (next_ m) H] (contract iadd imul M (taylor_ m)))
      (sum_of_models H Ws' Ms' ms')
  | _, _, _ => []
  end.

Definition row_polynomial (H : interval) (ms : list model) (p : prepared) : list interval :=
  longest iadd [rest_ p] (sum_of_models H (weights_ p) (moments_ p) ms).

Lemma row_polynomial_mem zs Gs f k t X mid m :
  cover_signals zs Gs -> short k f = true -> t ∈ X -> m ∈ mid ->
  let box := I.join mid (hull k X) in
  exists q, q ⊂ row_polynomial (isub X mid) (map (model_of mid box) Gs) (prepare (S n) T zs f) /\
    horner q (t - m) = trajectory_at T zs f t.
Proof.
  intros HJ Hk HX Hm box. rewrite at_rest. unfold row_polynomial, prepare, short in *. cbn [rest_ weights_ moments_].
  set (H := isub X mid). set (h := t - m).
  assert (Hh : h ∈ H) by now apply sub_mem.
  enough (exists q, q ⊂ sum_of_models H (map (map ofQ) (weights f)) (map (fun w => map ofQ (moments (S n) T 0 w)) (weights f))
      (map (model_of mid box) Gs) /\ horner q h = sum_of_deviations T (weights f) zs t) as (q & Hq & E).
  { exists (longest Rplus [Q2R (rest zs f)] q). split.
    - apply longest_mem; [|easy]. repeat constructor. apply ofQ_mem.
    - rewrite horner_longest, E. simpl. ring. }
  revert Hk. generalize (weights f). intros ws. revert ws.
  induction HJ as [|z G zs Gs HG _ IH]; intros [|w ws] Hk; cbn [map sum_of_models sum_of_deviations forallb] in *;
    try (exists []; split; [constructor|easy]).
  apply andb_prop in Hk as [Hw Hk]. apply Nat.leb_le in Hw.
  destruct (IH ws Hk) as (q & Hq & E). clear IH.
  assert (model_of mid box G = {| taylor_ := two_variables o iadd (map (coefficient (snd (G box) mid)) (seq 0 (S n)));
    error_ := fst (G box); next_ := coefficient (snd (G box) box) (S n) |}) as ->
    by (unfold model_of; now destruct (G box)).
  destruct (HG box) as (a & Ha & HE & HJ). destruct (G box) as [e J]. cbn [fst snd taylor_ error_ next_] in *.
  set (p := at_point a m (S n)).
  assert (Hp : p ⊂ map (coefficient (J mid)) (seq 0 (S n))).
  { unfold p, at_point. assert (L : forall i, In i (seq 0 (S n)) -> a i m ∈ coefficient (J mid) i).
    { intros i Hi. apply in_seq in Hi. apply (HJ m mid Hm). lia. }
    induction (seq 0 (S n)) as [|i l IHl]; simpl; constructor; [apply L; now left|]. apply IHl. intros; apply L. now right. }
  destruct (remainder_mem (deviation_of z) a m box e (coefficient (J box) (S n)) w h 0 H) as (r & Hr & Er); trivial.
  - now apply join_l.
  - intros y Hy. apply (HJ y box Hy). lia.
  - rewrite Rplus_0_l. unfold h. replace (m + (t - m)) with t by ring.
    apply (along_impl _ (fun y => y ∈ hull k X)); [intros; now apply join_r|]. now apply hull_mem.
  - now rewrite Rplus_0_l.
  - exists (longest Rplus (longest Rplus [r] (contract Rplus Rmult (map Q2R (moments (S n) T 0 w)) (two_variables 0 Rplus p))) q).
    split.
    + apply longest_mem; [|easy]. apply longest_mem; [now repeat constructor|].
      apply contract_mem; [apply ofQ_list|]. now apply two_variables_mem.
    + rewrite !horner_longest, E, horner_moments, Q2R_0 by (unfold p, at_point; now rewrite map_length, seq_length).
      rewrite Rplus_0_l in Er. unfold h in Er at 1. replace (m + (t - m)) with t in Er by ring.
      rewrite Er. simpl. fold p. ring.
Qed.

Definition accepts (depth k : nat) (Gs : list local) (X : interval) : prepared -> bool :=
  let mid := midpoint X in
  let H := isub X mid in
  let ms := map (model_of mid (I.join mid (hull k X))) Gs in
  fun p => polynomial_nonnegative depth (row_polynomial H ms p) H.

Lemma accepts_sound depth k zs Gs X t f :
  cover_signals zs Gs -> short k f = true -> t ∈ X ->
  accepts depth k Gs X (prepare (S n) T zs f) = true -> 0 <= trajectory_at T zs f t.
Proof.
  intros HJ Hk HX. destruct (midpoint_mem X) as [m Hm].
  destruct (row_polynomial_mem zs Gs f k t X (midpoint X) m HJ Hk HX Hm) as (q & Hq & <-).
  now apply (polynomial_nonnegative_sound _ _ _ _ _ Hq (sub_mem _ _ _ _ HX Hm)).
Qed.

(** Whether all rows are nowhere negative at the times of X: rows that fail are tried again on both halves. *)
Fixpoint boxes_nonnegative (fuel depth k : nat) (Gs : list local) (X : interval) (ps : list prepared) : bool :=
  let good := accepts depth k Gs X in
  match filter (fun p => negb (good p)) ps with
  | [] => true
  | failing =>
    match fuel with
    | O => false
    | S fuel' =>
      let (L, R) := I.bisect X in
      if boxes_nonnegative fuel' depth k Gs L failing then boxes_nonnegative fuel' depth k Gs R failing else false
    end
  end.

Lemma boxes_nonnegative_sound fuel depth k zs Gs X ps t f :
  cover_signals zs Gs -> short k f = true -> t ∈ X -> In (prepare (S n) T zs f) ps ->
  boxes_nonnegative fuel depth k Gs X ps = true -> 0 <= trajectory_at T zs f t.
Proof.
  intros HJ Hk. revert X ps; induction fuel as [|fuel IH]; intros X ps HX Hf; cbn [boxes_nonnegative];
    (destruct (accepts depth k Gs X (prepare (S n) T zs f)) eqn:E;
      [intros _; now apply (accepts_sound depth k zs Gs X)|]);
    assert (Hin : In (prepare (S n) T zs f) (filter (fun p => negb (accepts depth k Gs X p)) ps))
      by (apply filter_In; split; [easy|now rewrite E]);
    destruct (filter _ ps) as [|p l]; try easy.
  pose proof (I.bisect_correct X (Xreal t) HX) as B. destruct (I.bisect X) as [L R]. cbn [fst snd] in B.
  destruct (boxes_nonnegative fuel depth k Gs L (p :: l)) eqn:HL; [intros HR|easy].
  destruct B as [B|B]; eauto.
Qed.

End Rows.

(** * Certificates *)

(** How to prove a claim. [Tail]: boxes up to [from] or somewhat later, and one estimate for all later times. [Period]: boxes over one
    period. [Whole]: boxes over the window. [Steps]: the steps 0 to [last] one by one, and one estimate for all later steps. *)
Inductive cover : Set := Tail (from : Q) | Period (period : Q) | Whole | Steps (last : nat).

(** [degree] of Taylor polynomials; [halvings] and [cuts]: how often a box, and the interval of a polynomial, may be halved. *)
Record proof : Set := { degree : nat; halvings : nat; cuts : nat; by_ : cover }.

Definition rows (c : certificate) : list trajectory :=
  flat_map (distances (states c)) (state_set c) ++ flat_map (distances (inputs c)) (input_set c).

Fixpoint has_period (p : Q) (k : kernel) : bool :=
  match k with
  | Periodic _ _ q => Qeq_bool p q
  | Sum a b | Product a b => has_period p a && has_period p b
  | _ => false
  end.

Definition starts (from : Q) : list Q := map (fun i => (from * (1 + (Z.of_nat i # 8)))%Q) (seq 0 33).

(** Whether the rows [fs], with up to [k] shifts of signals, are nowhere negative at the times of a claim. *)
Definition proves (how : proof) (T : Q) (zs : list signal) (k : nat) (fs : list trajectory) (times : claim) : bool :=
  let n := degree how in
  if forallb (fun z => proper (prior z)) zs && forallb (short k) fs then
    let Gs := map (local_of_signal (S (S n))) zs in
    let ps := map (prepare (S n) T zs) fs in
    let boxes a b := boxes_nonnegative n T (halvings how) (cuts how) k Gs (I.join (ofQ a) (ofQ b)) ps in
    let at_all X := forallb (fun p => nonnegative (plain T Gs X p)) ps in
    match times, by_ how with
    | AllTimes, Tail from =>
      match find (fun q => at_all (I.upper_extent (ofQ q))) (starts from) with
      | Some from' => boxes 0%Q from'
      | None => false
      end
    | AllPhases, Period p =>
      if Qle_bool 0 p && negb (Qeq_bool p 0) && forallb (fun z => has_period p (prior z)) zs then boxes 0%Q p else false
    | Window a b, Whole => boxes a b
    | Instants, Steps last =>
      Qle_bool 0 T && at_all (I.upper_extent (imul (ofnat (S last)) (ofQ T))) &&
      forallb (fun j => at_all (imul (ofnat j) (ofQ T))) (seq 0 (S last))
    | _, _ => false
    end
  else false.

Fixpoint has_kink (k : kernel) : bool :=
  match k with
  | SquaredExponential _ _ | Periodic _ _ _ => false
  | Matern32 _ _ | Matern52 _ _ => true
  | Sum a b | Product a b => has_kink a || has_kink b
  end.

(** Shifts are taken together, so that their sums cancel; or one by one, where kinks would be between them. *)
Definition check (c : certificate) (how : proof) : bool :=
  let T := sampling_time c in
  let zs := signals c in
  let fs := rows c in
  let k := fold_right Nat.max 0%nat (map (@length Q) (flat_map weights fs)) in
  if solves (states c) (inputs c) (system c) (states c) && forallb (short k) fs then
    if existsb (fun z => has_kink (prior z)) zs
    then proves how T (copied T k zs) 1 (map (single k) fs) (times c)
    else proves how T zs k fs (times c)
  else false.

Lemma kappa_period p k r : 0 < Q2R p -> has_period p k = true -> kappa k (r + p) = kappa k r.
Proof.
  intros Hp. induction k; cbn [has_period kappa]; try easy.
  - intros E%Qeq_bool_eq. rewrite <- (Qeq_eqR _ _ E). replace (PI * (r + p) / p) with (PI * r / p + PI) by (field; lra).
    rewrite neg_sin. do 2 f_equal. unfold Rdiv. ring.
  - intros [Ha Hb]%andb_prop. now rewrite IHk1, IHk2.
  - intros [Ha Hb]%andb_prop. now rewrite IHk1, IHk2.
Qed.

Lemma trajectory_period p T zs f t :
  0 < Q2R p -> forallb (fun z => has_period p (prior z)) zs = true ->
  trajectory_at T zs f (t + p) = trajectory_at T zs f t.
Proof.
  intros Hp Hz. unfold trajectory_at. f_equal. generalize (weights f). clear f. intros ws. revert ws.
  induction zs as [|z zs IH]; intros [|w ws]; cbn [sum_of_signals]; try easy.
  apply andb_prop in Hz as [Hz Hzs]. rewrite (IH Hzs). f_equal. clear - Hp Hz.
  revert t; induction w as [|a w IH]; intros t; cbn [shifts]; [easy|].
  replace (t + p + T) with (t + T + p) by ring. rewrite IH. do 2 f_equal. unfold signal_at. f_equal.
  induction (terms z) as [|i l IHl]; cbn [deviation]; [easy|]. rewrite IHl.
  replace (t + p - centre i) with (t - centre i + p) by ring. now rewrite kappa_period.
Qed.

Lemma into_one_period (p t : R) : 0 < p -> exists s (m : nat), 0 <= s <= p /\ (t = s + INR m * p \/ s = t + INR m * p).
Proof.
  intros Hp. destruct (base_Int_part (t / p)) as [H1 H2]. set (z := Int_part (t / p)) in *.
  assert (E : t = t / p * p) by (field; lra). exists (t - IZR z * p), (Z.abs_nat z). rewrite INR_IZR_INZ, Zabs2Nat.id_abs. split.
  - split; [nra|]. nra.
  - destruct (Z.abs_spec z) as [[_ ->]|[_ ->]]; [left|right]; rewrite ?opp_IZR; ring.
Qed.

Lemma proves_sound how T zs k fs times t f :
  proves how T zs k fs times = true -> claimed times T t -> In f fs -> 0 <= trajectory_at T zs f t.
Proof.
  unfold proves. set (n := degree how).
  destruct (_ && forallb (short k) fs) eqn:E; [|easy]. apply andb_prop in E as [Hs Hk].
  set (Gs := map (local_of_signal (S (S n))) zs).
  intros H Ht Hf.
  assert (HJ : cover_signals n zs Gs).
  { unfold cover_signals, Gs. clear - Hs. induction zs as [|z l IH]; simpl in Hs |- *; constructor.
    - apply local_of_signal_sound; [lia|]. now apply andb_prop in Hs.
    - apply IH. now apply andb_prop in Hs. }
  rewrite forallb_forall in Hk. specialize (Hk f Hf).
  pose proof (in_map (prepare (S n) T zs) _ _ Hf) as Hp.
  assert (Boxes : forall (a b : Q) t, a <= t <= b -> boxes_nonnegative n T (halvings how) (cuts how) k Gs
    (I.join (ofQ a) (ofQ b)) (map (prepare (S n) T zs) fs) = true -> 0 <= trajectory_at T zs f t).
  { intros a b s Hab B. refine (boxes_nonnegative_sound n T _ _ _ zs Gs _ _ s f HJ Hk _ Hp B).
    apply (between_mem a b); [apply join_l, ofQ_mem|apply join_r, ofQ_mem|].
    unfold Rmin, Rmax. destruct (Rle_dec a b); lra. }
  assert (All : forall t X, t ∈ X -> forallb (fun p => nonnegative (plain T Gs X p)) (map (prepare (S n) T zs) fs) = true ->
    0 <= trajectory_at T zs f t).
  { intros s X HX A. rewrite forallb_forall in A. specialize (A _ Hp).
    apply (nonnegative_mem _ _ A). now apply (plain_mem n). }
  destruct times as [| |a b|]; destruct (by_ how) as [from|p| |last]; try easy; cbn [claimed] in Ht.
  - destruct (find _ _) as [from'|] eqn:A in H; [|easy]. apply find_some in A as [_ A]. clear from. rename from' into from.
    destruct (Rle_dec t from) as [L|L].
    + apply (Boxes 0%Q from); [rewrite Q2R_0; lra|easy].
    + apply (All t _ (I.upper_extent_correct _ t _ (ofQ_mem from) ltac:(lra)) A).
  - destruct (_ && forallb _ zs) eqn:E in H; [|easy]. apply andb_prop in E as [E P]. apply andb_prop in E as [E0 E1].
    assert (Hp0 : 0 < Q2R p).
    { apply Qle_bool_iff, Qle_Rle in E0. rewrite Q2R_0 in E0. destruct E0 as [L|Z]; [easy|]. exfalso.
      rewrite <- Q2R_0 in Z. apply eqR_Qeq in Z. symmetry in Z. apply Qeq_eq_bool in Z. now rewrite Z in E1. }
    destruct (into_one_period p t Hp0) as (s & m & Hs' & D).
    assert (M : forall m t, trajectory_at T zs f (t + INR m * p) = trajectory_at T zs f t).
    { clear - Hp0 P. induction m as [|m IH]; intros t.
      - f_equal. simpl. ring.
      - rewrite S_INR. replace (t + (INR m + 1) * p) with (t + INR m * p + p) by ring.
        now rewrite trajectory_period. }
    enough (0 <= trajectory_at T zs f s) as G by (destruct D as [->| ->]; rewrite M in *; easy).
    apply (Boxes 0%Q p); [now rewrite Q2R_0|easy].
  - now apply (Boxes a b).
  - apply andb_prop in H as [H B]. apply andb_prop in H as [H0 A]. destruct Ht as [j ->].
    apply Qle_bool_iff, Qle_Rle in H0. rewrite Q2R_0 in H0.
    destruct (Nat.le_gt_cases j last) as [L|L].
    + rewrite forallb_forall in B. apply (All _ (imul (ofnat j) (ofQ T))); [apply mul_mem; auto using ofnat_mem, ofQ_mem|].
      apply B. apply in_seq. lia.
    + apply (All _ _ (I.upper_extent_correct _ (INR j * T) _ (mul_mem _ _ _ _ (ofnat_mem (S last)) (ofQ_mem T)) ltac:(
        apply Rmult_le_compat_r; [easy|]; apply le_INR; lia)) A).
Qed.

Theorem check_sound c how : check c how = true -> holds c.
Proof.
  unfold check. set (k := fold_right Nat.max 0%nat _). intros H.
  destruct (_ && _) eqn:E in H; [|easy]. apply andb_prop in E as [E Hk]. split.
  - intros t. now apply solves_sound.
  - intros t Ht.
    assert (R : forall f, In f (rows c) -> 0 <= trajectory_at (sampling_time c) (signals c) f t).
    { intros f Hf. destruct (existsb _ _) in H; [|now apply (proves_sound _ _ _ _ _ _ t f H)].
      rewrite <- (at_single _ k).
      - apply (proves_sound _ _ _ _ _ _ t _ H Ht). now apply in_map.
      - rewrite forallb_forall in Hk. now apply Hk. }
    split; intros b Hb; apply distances_sound; intros f Hf; apply R;
      apply in_or_app; [left|right]; apply in_flat_map; eauto.
Qed.

(** * Refutations: some row is negative at a time t of the claim, which is that of [step] if it is about instants *)

Definition refute (c : certificate) (t : Q) (step : N) : bool :=
  let T := sampling_time c in
  let zs := signals c in
  let Gs := map (local_of_signal 2) zs in
  forallb (fun z => proper (prior z)) zs &&
  match times c with
  | AllTimes => Qle_bool 0 t
  | AllPhases => true
  | Window a b => Qle_bool a t && Qle_bool t b
  | Instants => Qeq_bool t (inject_Z (Z.of_N step) * T)
  end &&
  existsb (fun f => negative (plain T Gs (ofQ t) (prepare 1 T zs f))) (rows c).

Theorem refute_sound c t step : refute c t step = true -> ~ holds c.
Proof.
  unfold refute. set (T := sampling_time c). set (zs := signals c).
  intros [H N]%andb_prop [_ C]. apply andb_prop in H as [Hs Ht]. apply existsb_exists in N as (f & Hf & N).
  assert (HJ : cover_signals 0 zs (map (local_of_signal 2) zs)).
  { unfold cover_signals. clear - Hs. induction zs as [|z l IH]; simpl in Hs |- *; constructor.
    - apply local_of_signal_sound; [lia|]. now apply andb_prop in Hs.
    - apply IH. now apply andb_prop in Hs. }
  pose proof (negative_mem _ _ N (plain_mem 0 T zs _ f t _ HJ (ofQ_mem t))) as L.
  enough (0 <= trajectory_at T zs f t) by lra.
  assert (Hc : claimed (times c) T t).
  { destruct (times c) as [| |a b|]; cbn [claimed].
    - apply Qle_bool_iff, Qle_Rle in Ht. now rewrite Q2R_0 in Ht.
    - easy.
    - apply andb_prop in Ht as [Ha Hb]. split; now apply Qle_Rle, Qle_bool_iff.
    - exists (N.to_nat step). apply Qeq_bool_eq, Qeq_eqR in Ht. rewrite Ht, Q2R_mult. f_equal.
      rewrite INR_IZR_INZ, N_nat_Z. unfold Q2R, inject_Z. simpl. field. }
  destruct (C t Hc) as [CX CU].
  apply in_app_or in Hf as [Hf|Hf]; apply in_flat_map in Hf as (b & Hb & Hf).
  - exact (proj2 (distances_sound T zs (states c) b t) (CX b Hb) f Hf).
  - exact (proj2 (distances_sound T zs (inputs c) b t) (CU b Hb) f Hf).
Qed.

(** * Disturbances *)

Fixpoint iproduct (n : nat) (R V : list interval) : interval :=
  match n with
  | O => o
  | S n' => iadd (imul (hd o R) (hd o V)) (iproduct n' (tl R) (tl V))
  end.

Fixpoint ithrough (n : nat) (R : list interval) (M : list (list interval)) : list interval :=
  match n with
  | O => []
  | S n' => jadd (jscale (hd o R) (hd [] M)) (ithrough n' (tl R) (tl M))
  end.

Lemma iproduct_mem n r R v V : around n r R -> around n v V -> product n r v ∈ iproduct n R V.
Proof.
  unfold product. revert r R v V; induction n as [|n IH]; intros r R v V HR HV; [apply zero_mem|].
  apply around_tl in HR as [HR0 HR]. apply around_tl in HV as [HV0 HV].
  cbn [sum iproduct]. apply add_mem; [now apply mul_mem|]. now apply (IH (tail r) _ (tail v)).
Qed.

Lemma ithrough_mem n N r R (A : matrix) M :
  around n r R -> (forall i, (i < n)%nat -> around N (A i) (nth i M [])) ->
  around N (through n r A) (ithrough n R M).
Proof.
  revert r R A M; induction n as [|n IH]; intros r R A M HR HM.
  - intros k _. rewrite coefficient_nil. apply zero_mem.
  - apply around_tl in HR as [HR0 HR]. cbn [ithrough].
    apply (around_add N (fun j => r 0%nat * A 0%nat j) (through n (tail r) (tail A))).
    + apply around_scale; [easy|]. replace (hd [] M) with (nth 0 M []) by now destruct M. apply HM. lia.
    + apply IH; [easy|]. intros i Hi. replace (nth i (tl M) []) with (nth (S i) M []) by (destruct M; [now destruct i|easy]).
      apply HM. lia.
Qed.

Definition ivec : list Q -> list interval := map ofQ.

Lemma ivec_mem n l : around n (vec l) (ivec l).
Proof.
  intros k _. unfold vec, ivec, coefficient. revert k; induction l as [|q l IH]; intros [|k]; simpl; auto using ofQ_mem.
  all: unfold Q2R; simpl; rewrite Rmult_0_l; apply zero_mem.
Qed.

Lemma abs_mem x X : x ∈ X -> Rabs x ∈ I.abs X.
Proof. exact (I.abs_correct X (Xreal x)). Qed.

Lemma around_abs n r R : around n r R -> around n (fun j => Rabs (r j)) (map I.abs R).
Proof.
  revert r R; induction n as [|n IH]; intros r [|X R] HR; try (intros k Hk; lia).
  - intros k Hk. rewrite (around_nil _ _ HR k Hk), Rabs_R0. rewrite coefficient_nil. apply zero_mem.
  - apply around_tail in HR as [HX HR]. apply around_cons; [now apply abs_mem|]. now apply (IH (tail r)).
Qed.

Lemma nth_map_seq {A} (f : nat -> A) n i a : (i < n)%nat -> nth i (map f (seq 0 n)) a = f i.
Proof.
  intros H. rewrite (nth_indep _ a (f 0%nat)) by now rewrite map_length, seq_length.
  now rewrite map_nth, seq_nth.
Qed.

(** [head] powers of F one by one, [more] + 1 for the rest: F^(more + 1) maps the box |x_i| <= [box]_i into
    [contraction] times itself. *)
Record tube : Set := { head : nat; more : nat; contraction : Q; box : list Q }.

Section Tube.

Variables (c : certificate) (d : disturbance) (b : tube).
Let n := length (states c).
Let m := length (inputs c).
Definition ifeedback := map ivec (feedback d).
Definition irow (of_ : equation -> list Q) (i : nat) : list interval := ivec (of_ (nth i (system c) no_equation)).
Definition iF : list (list interval) :=
  map (fun i => jadd (irow of_states i) (ithrough m (irow of_inputs i) ifeedback)) (seq 0 n).
Definition ivectors (Z : zonotope) : list (list interval) := map ivec (middle Z :: generators Z).
Definition iY : list (list interval) :=
  ivectors (pushes d) ++ ivectors (noise d) ++
  map (fun y => map (fun i => iproduct n (irow of_states i) y) (seq 0 n)) (ivectors (noise d)).

Definition isize (Y : list (list interval)) (R : list interval) : interval :=
  fold_right (fun y => iadd (I.abs (iproduct n R y))) o Y.
Definition iextent (i : nat) : interval := fold_right (fun y => iadd (I.abs (coefficient y i))) o iY.
Definition ireach (R : list interval) : interval := iproduct n (map I.abs R) (ivec (box b)).

Fixpoint isum (M : list (list interval)) (f : list interval -> interval) (k : nat) (R : list interval) : interval :=
  match k with
  | O => o
  | S k' => iadd (f R) (isum M f k' (ithrough n R M))
  end.
Fixpoint iiterated (M : list (list interval)) (k : nat) (R : list interval) : list interval :=
  match k with
  | O => R
  | S k' => iiterated M k' (ithrough n R M)
  end.

Definition ilimit (M Y : list (list interval)) (R : list interval) : interval :=
  iadd (isum M (isize Y) (head b) R)
    (idiv (isum M ireach (S (more b)) (iiterated M (head b) R)) (isub (ofZ 1) (ofQ (contraction b)))).

Definition contracts (M : list (list interval)) : bool :=
  forallb (Qle_bool 0) (box b) && negb (Qle_bool 1 (contraction b)) &&
  forallb (fun i => let p := ofQ (nth i (box b) 0%Q) in
    nonnegative (isub p (iextent i)) &&
    nonnegative (isub (imul (ofQ (contraction b)) p) (ireach (iiterated M (more b) (nth i M []))))) (seq 0 n).

Let F := F_ c d.
Let Y := Y_ c d.
Let p := vec (box b).

Lemma iF_mem i : (i < n)%nat -> around n (F i) (nth i iF []).
Proof.
  intros Hi. unfold iF. rewrite nth_map_seq by easy. apply around_add; [apply ivec_mem|].
  apply ithrough_mem; [apply ivec_mem|]. intros j _. unfold ifeedback, K_, mat.
  change (@nil interval) with (ivec []). rewrite map_nth. apply ivec_mem.
Qed.

Lemma ivectors_mem Z : Forall2 (around n) (vectors Z) (ivectors Z).
Proof. unfold vectors, ivectors. induction (middle Z :: generators Z); simpl; constructor; auto using ivec_mem. Qed.

Lemma iY_mem : Forall2 (around n) Y iY.
Proof.
  apply Forall2_app; [apply ivectors_mem|]. apply Forall2_app; [apply ivectors_mem|].
  induction (ivectors_mem (noise d)); simpl; constructor; auto.
  intros k Hk. unfold coefficient. rewrite nth_map_seq by easy. apply iproduct_mem; [apply ivec_mem|easy].
Qed.

Lemma isize_mem V W r R : Forall2 (around n) V W -> around n r R -> size n V r ∈ isize W R.
Proof.
  intros HV HR. induction HV; simpl; [apply zero_mem|]. apply add_mem; [|easy]. now apply abs_mem, iproduct_mem.
Qed.

Lemma iextent_mem i : (i < n)%nat -> extent Y i ∈ iextent i.
Proof.
  intros Hi. unfold iextent. induction iY_mem as [|y W ys Ws HW _ IH]; simpl; [apply zero_mem|].
  apply add_mem; [|easy]. apply abs_mem. now apply HW.
Qed.

Lemma ireach_mem r R : around n r R -> reach n p r ∈ ireach R.
Proof. intros HR. apply (iproduct_mem n (fun j => Rabs (r j)) _ p); [now apply around_abs|apply ivec_mem]. Qed.

Lemma ithrough_F r R : around n r R -> around n (through n r F) (ithrough n R iF).
Proof. intros HR. apply ithrough_mem; [easy|apply iF_mem]. Qed.

Lemma isum_mem (f : vector -> R) g k r R :
  (forall r R, around n r R -> f r ∈ g R) -> around n r R ->
  sum k (fun i => f (iterated n F i r)) ∈ isum iF g k R.
Proof.
  intros H. revert r R; induction k as [|k IH]; intros r R HR; cbn [sum isum]; [apply zero_mem|].
  apply add_mem; [now apply H|]. apply (IH (through n r F)). now apply ithrough_F.
Qed.

Lemma iiterated_mem k r R : around n r R -> around n (iterated n F k r) (iiterated iF k R).
Proof. revert r R; induction k as [|k IH]; intros r R HR; [easy|]. apply IH. now apply ithrough_F. Qed.

Definition limit (r : vector) : R :=
  sum (head b) (fun i => size n Y (iterated n F i r)) +
  sum (S (more b)) (fun i => reach n p (iterated n F i (iterated n F (head b) r))) / (1 - Q2R (contraction b)).

Lemma ilimit_mem r R : around n r R -> limit r ∈ ilimit iF iY R.
Proof.
  intros HR. apply add_mem.
  - apply (isum_mem (size n Y)); [|easy]. intros; apply isize_mem; [apply iY_mem|easy].
  - apply div_mem; [|apply sub_mem; [apply ofZ_mem|apply ofQ_mem]].
    apply (isum_mem (reach n p)); [apply ireach_mem|]. now apply iiterated_mem.
Qed.

Lemma contracts_sound k r :
  contracts iF = true -> sum k (fun i => size n Y (iterated n F i r)) <= limit r.
Proof.
  intros [[Hp Ha]%andb_prop H]%andb_prop. rewrite forallb_forall in Hp, H.
  assert (P : forall j, 0 <= p j).
  { intros j. unfold p, vec. destruct (nth_in_or_default j (box b) 0%Q) as [I| ->]; [|rewrite Q2R_0; lra].
    specialize (Hp _ I). apply Qle_bool_iff, Qle_Rle in Hp. now rewrite Q2R_0 in Hp. }
  assert (A1 : Q2R (contraction b) < 1).
  { replace 1 with (Q2R 1) by (unfold Q2R; simpl; field). apply Qlt_Rlt, Qnot_le_lt. intros L.
    apply Qle_bool_iff in L. now rewrite L in Ha. }
  assert (C : forall i, (i < n)%nat -> extent Y i <= p i /\
      reach n p (iterated n F (more b) (F i)) <= Q2R (contraction b) * p i).
  { intros i Hi. specialize (H i ltac:(apply in_seq; lia)). apply andb_prop in H as [H1 H2]. split.
    - pose proof (nonnegative_mem _ _ H1 (sub_mem _ _ _ _ (ofQ_mem (nth i (box b) 0%Q)) (iextent_mem i Hi))) as L.
      unfold p, vec. lra.
    - pose proof (nonnegative_mem _ _ H2 (sub_mem _ _ _ _ (mul_mem _ _ _ _ (ofQ_mem (contraction b)) (ofQ_mem (nth i (box b) 0%Q)))
        (ireach_mem _ _ (iiterated_mem (more b) _ _ (iF_mem i Hi))))) as L.
      unfold p at 2, vec. lra. }
  apply (sum_of_sizes n F p); trivial.
  - intros q. split; [apply size_nonneg|]. apply size_reach. intros; now apply C.
  - apply reach_contracts; [easy|]. intros; now apply C.
Qed.

Fixpoint same (r s : list Q) : bool :=
  match r, s with
  | [], [] => true
  | x :: r', y :: s' => Qeq_bool x y && same r' s'
  | _, _ => false
  end.

Lemma same_sound r s v : same r s = true -> dot r v = dot s v.
Proof.
  revert s v; induction r as [|x r IH]; intros [|y s] v H; try easy. simpl in H. apply andb_prop in H as [E H].
  destruct v as [|z v]; [easy|]. simpl. rewrite (IH s) by easy. apply Qeq_bool_eq, Qeq_eqR in E. now rewrite E.
Qed.

(** Whether the bound [a] follows from one of those that are [kept], with room for L. *)
Definition has_room (kept : list bound) (length_ : nat) (L : interval) (a : bound) : bool :=
  Nat.leb (length (row a)) length_ &&
  existsb (fun k => same (row a) (row k) &&
    match upper a, upper k with
    | None, _ => true
    | Some _, None => false
    | Some h, Some h' => nonnegative (isub (ofQ (h - h')) L)
    end &&
    match lower a, lower k with
    | None, _ => true
    | Some _, None => false
    | Some l, Some l' => nonnegative (isub (ofQ (l' - l)) L)
    end) kept.

Lemma has_room_sound kept length_ L l a x y :
  has_room kept length_ L a = true -> l ∈ L -> (forall k, In k kept -> within k y) ->
  Rabs (dot (row a) x - dot (row a) y) <= l -> within a x.
Proof.
  intros [_ H]%andb_prop Hl Hk Hd. apply existsb_exists in H as (k & Ik & H).
  apply andb_prop in H as [[E U]%andb_prop W]. specialize (Hk k Ik) as [Kl Ku].
  rewrite <- (same_sound _ _ y E) in Kl, Ku. apply Rcomplements.Rabs_le_between in Hd. split.
  - destruct (lower a) as [q|], (lower k) as [q'|]; try easy.
    pose proof (nonnegative_mem _ _ W (sub_mem _ _ _ _ (ofQ_mem (q' - q)) Hl)) as G. rewrite Q2R_minus in G. lra.
  - destruct (upper a) as [q|], (upper k) as [q'|]; try easy.
    pose proof (nonnegative_mem _ _ U (sub_mem _ _ _ _ (ofQ_mem (q - q')) Hl)) as G. rewrite Q2R_minus in G. lra.
Qed.

Definition check_tube : bool :=
  let M := iF in
  let W := iY in
  let V := ivectors (noise d) in
  fits c d && contracts M &&
  forallb (fun a => has_room (state_set c) n (iadd (ilimit M W (ivec (row a))) (isize V (ivec (row a)))) a) (all_states d) &&
  forallb (fun a => has_room (input_set c) m (ilimit M W (ithrough m (ivec (row a)) ifeedback)) a) (all_inputs d).

Theorem check_tube_sound : holds c -> check_tube = true -> withstands c d.
Proof.
  intros Hc [[[Hf Ht]%andb_prop HX]%andb_prop HU]%andb_prop t0 xs us w v Hr Hw Hv k Hk.
  rewrite forallb_forall in HX, HU.
  destruct (run_bounds c d t0 xs us w v limit Hf Hc Hr Hw Hv (fun k r => contracts_sound k r Ht) k) as [BX BU].
  destruct Hc as [_ Hc]. destruct (Hc _ Hk) as [CX CU]. split; intros a Ha.
  - specialize (HX a Ha). refine (has_room_sound _ _ _ _ a _ _ HX _ CX (BX (row a) _)).
    + apply add_mem; [apply ilimit_mem, ivec_mem|]. apply isize_mem; [apply ivectors_mem|apply ivec_mem].
    + now apply Nat.leb_le; apply andb_prop in HX as [HX _].
  - specialize (HU a Ha). refine (has_room_sound _ _ _ _ a _ _ HU _ CU (BU (row a) _)).
    + apply ilimit_mem. apply ithrough_mem; [apply ivec_mem|]. intros j _. unfold ifeedback, K_, mat.
      change (@nil interval) with (ivec []). rewrite map_nth. apply ivec_mem.
    + now apply Nat.leb_le; apply andb_prop in HU as [HU _].
Qed.

End Tube.

End Checker.

(** With the processor's floating-point numbers, and with numbers made of integers, which are slower. *)
From Interval Require Import Float.Primitive_ops Float.Specific_ops Float.Specific_bigint.
Module Native := Checker PrimitiveFloat.
Module Integers := SpecificFloat BigIntRadix2.
Module Emulated := Checker Integers.
