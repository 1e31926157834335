(** What Coq takes on trust here: the axioms of its real numbers, and those of the processor's integers and
    floating-point numbers. [assumptions.txt] holds the names that this file prints, a set for each arithmetic. *)

From Trackably Require Import Checker.

Definition native := (Native.check_sound, Native.check_tube_sound, Native.refute_sound).
Definition emulated := (Emulated.check_sound, Emulated.check_tube_sound, Emulated.refute_sound).
Print Assumptions native.
Print Assumptions emulated.
