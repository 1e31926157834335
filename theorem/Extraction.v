(** The checker as a program: OCaml with the processor's floating-point numbers, of which Coq's kernel has the
    operations (`coq-core.kernel`), and integers of zarith. This file translates the checker; it proves nothing.

    Extraction also writes out the definitions of real numbers, which no computation of the checker needs. *)

From Coq Require Import Floats Extraction ExtrOcamlBasic ExtrOcamlZBigInt ExtrOcamlNatInt ExtrOCamlInt63 ExtrOCamlFloats.
From Trackably Require Import Statement Checker.

(** Coq's own translation leaves out where these constructors are. *)
Extract Inductive PrimFloat.float_comparison =>
  "Float64.float_comparison" [ "Float64.FEq" "Float64.FLt" "Float64.FGt" "Float64.FNotComparable" ].
Extract Inductive FloatClass.float_class => "Float64.float_class"
  [ "Float64.PNormal" "Float64.NNormal" "Float64.PSubn" "Float64.NSubn" "Float64.PZero" "Float64.NZero" "Float64.PInf"
    "Float64.NInf" "Float64.NaN" ].

Extract Constant ClassicalDedekindReals.sig_forall_dec => "(fun _ -> assert false)".
Set Warnings "-extraction-opaque-accessed".
Extraction "verified.ml" Native.check Native.refute Native.check_tube.
