(* Read files that `python -m trackably theorem` writes for Coq, and let the checker that Coq extracted decide them.

   What this file does is to read; what is decided, and proved once, is in verified.ml. The verdict is about the numbers
   that are in the file, as they are read here. *)

open Verified
module N = Native

type token = Word of string | Number of Big_int_Z.big_int | Sign of string

type value = Rational of q | Made of string * value list | Listed of value list | Fields of (string * value) list

exception Unreadable of string

(* Comments are left out; `:=`, `{|` and `|}` are one token. *)
let rec tokens text i =
  let here = i < String.length text in
  let next = if i + 1 < String.length text then text.[i + 1] else ' ' in
  let rec until stops j = if j < String.length text && not (stops text.[j]) then until stops (j + 1) else j in
  let digit c = c >= '0' && c <= '9' in
  let letter c = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c = '_' in
  let taken stops make =
    let j = until stops (i + 1) in
    make (String.sub text i (j - i)) :: tokens text j in
  if not here then []
  else
    match text.[i], next with
    | (' ' | '\n'), _ -> tokens text (i + 1)
    | '(', '*' ->
      let rec close j = if text.[j] = '*' && text.[j + 1] = ')' then j + 2 else close (j + 1) in
      tokens text (close (i + 2))
    | ':', '=' | '{', '|' | '|', '}' -> Sign (String.sub text i 2) :: tokens text (i + 2)
    | c, _ when digit c -> taken (fun c -> not (digit c)) (fun s -> Number (Big_int_Z.big_int_of_string s))
    | c, _ when letter c -> taken (fun c -> not (letter c || digit c || c = '.')) (fun s -> Word s)
    | c, _ -> Sign (String.make 1 c) :: tokens text (i + 1)

let one = Big_int_Z.unit_big_int

(* A value, and what comes after it. Rational numbers are (n # d) and (n # 2 ^ k). *)
let rec value = function
  | Sign "(" :: Number n :: Sign "#" :: rest -> rational n rest
  | Sign "(" :: Sign "-" :: Number n :: Sign "#" :: rest -> rational (Big_int_Z.minus_big_int n) rest
  | Sign "(" :: rest -> (match applied rest with v, Sign ")" :: rest -> v, rest | _ -> raise (Unreadable "no )"))
  | Sign "[" :: Sign "]" :: rest -> Listed [], rest
  | Sign "[" :: rest -> let vs, rest = items rest in Listed vs, rest
  | Sign "{|" :: rest -> let fs, rest = fields rest in Fields fs, rest
  | Word name :: rest -> Made (name, []), rest
  | Number n :: rest -> Rational { qnum = n; qden = one }, rest
  | _ -> raise (Unreadable "a value is missing")

and rational n = function
  | Number two :: Sign "^" :: Number k :: Sign ")" :: rest ->
    Rational { qnum = n; qden = Big_int_Z.power_big_int_positive_big_int two k }, rest
  | Number d :: Sign ")" :: rest -> Rational { qnum = n; qden = d }, rest
  | _ -> raise (Unreadable "a denominator is missing")

and applied rest =
  match value rest with
  | Made (name, []), rest -> let vs, rest = arguments rest in Made (name, vs), rest
  | found -> found

and arguments = function
  | (Sign (")" | "]" | "|}" | ";" | ".") :: _) as rest -> [], rest
  | rest -> let v, rest = value rest in let vs, rest = arguments rest in v :: vs, rest

and items rest =
  match applied rest with
  | v, Sign ";" :: rest -> let vs, rest = items rest in v :: vs, rest
  | v, Sign "]" :: rest -> [ v ], rest
  | _ -> raise (Unreadable "no ]")

and fields = function
  | Word name :: Sign ":=" :: rest ->
    (match applied rest with
     | v, Sign ";" :: rest -> let fs, rest = fields rest in (name, v) :: fs, rest
     | v, Sign "|}" :: rest -> [ name, v ], rest
     | _ -> raise (Unreadable "no |}"))
  | _ -> raise (Unreadable "a field is missing")

(* What comes after these words. *)
let rec after words rest =
  let rec starts words rest =
    match words, rest with
    | [], _ -> true
    | w :: words, t :: rest -> w = t && starts words rest
    | _ -> false in
  match rest with
  | [] -> None
  | _ when starts words rest -> Some (List.filteri (fun i _ -> i >= List.length words) rest)
  | _ :: rest -> after words rest

let wrong what = raise (Unreadable ("this is no " ^ what))
let number = function Rational q when Big_int_Z.sign_big_int q.qden > 0 -> q | _ -> wrong "number"
let whole v = Big_int_Z.int_of_big_int (number v).qnum
let list of_ = function Listed vs -> List.map of_ vs | _ -> wrong "list"
let vector = list number
let matrix = list vector

let fields names = function
  | Fields fs when List.map fst fs = names -> List.map snd fs
  | _ -> wrong ("record of " ^ String.concat ", " names)

let rec kernel = function
  | Made ("SquaredExponential", [ s; l ]) -> SquaredExponential (number s, number l)
  | Made ("Periodic", [ s; l; p ]) -> Periodic (number s, number l, number p)
  | Made ("Matern32", [ s; l ]) -> Matern32 (number s, number l)
  | Made ("Matern52", [ s; l ]) -> Matern52 (number s, number l)
  | Made ("Sum", [ a; b ]) -> Sum (kernel a, kernel b)
  | Made ("Product", [ a; b ]) -> Product (kernel a, kernel b)
  | _ -> wrong "kernel"

let term v = match fields [ "weight"; "centre" ] v with
  | [ c; t ] -> { weight = number c; centre = number t } | _ -> wrong "term"

let signal v = match fields [ "prior"; "mean"; "terms" ] v with
  | [ k; m; ts ] -> { prior = kernel k; mean = number m; terms = list term ts } | _ -> wrong "signal"

let trajectory v = match fields [ "offset"; "weights" ] v with
  | [ o; ws ] -> { offset = number o; weights = matrix ws } | _ -> wrong "trajectory"

let equation v = match fields [ "of_states"; "of_inputs"; "constant" ] v with
  | [ a; b; c ] -> { of_states = vector a; of_inputs = vector b; constant = number c } | _ -> wrong "equation"

let side = function
  | Made ("None", []) -> None
  | Made ("Some", [ q ]) -> Some (number q)
  | _ -> wrong "side of a bound"

let bound v = match fields [ "row"; "lower"; "upper" ] v with
  | [ r; l; h ] -> { row = vector r; lower = side l; upper = side h } | _ -> wrong "bound"

let claim = function
  | Made ("AllTimes", []) -> AllTimes
  | Made ("AllPhases", []) -> AllPhases
  | Made ("Window", [ a; b ]) -> Window (number a, number b)
  | Made ("Instants", []) -> Instants
  | _ -> wrong "claim"

let certificate v =
  match fields [ "signals"; "sampling_time"; "system"; "states"; "inputs"; "state_set"; "input_set"; "times" ] v with
  | [ zs; t; s; x; u; xs; us; c ] ->
    { signals = list signal zs; sampling_time = number t; system = list equation s; states = list trajectory x;
      inputs = list trajectory u; state_set = list bound xs; input_set = list bound us; times = claim c }
  | _ -> wrong "certificate"

let zonotope v = match fields [ "middle"; "generators" ] v with
  | [ m; gs ] -> { middle = vector m; generators = matrix gs } | _ -> wrong "zonotope"

let disturbance v = match fields [ "feedback"; "pushes"; "noise"; "all_states"; "all_inputs" ] v with
  | [ k; w; n; xs; us ] ->
    { feedback = matrix k; pushes = zonotope w; noise = zonotope n; all_states = list bound xs;
      all_inputs = list bound us }
  | _ -> wrong "disturbance"

let cover = function
  | Made ("Native.Tail", [ q ]) -> N.Tail (number q)
  | Made ("Native.Period", [ q ]) -> N.Period (number q)
  | Made ("Native.Whole", []) -> N.Whole
  | Made ("Native.Steps", [ k ]) -> N.Steps (whole k)
  | _ -> wrong "cover"

let proof v = match fields (List.map (( ^ ) "Native.") [ "degree"; "halvings"; "cuts"; "by_" ]) v with
  | [ d; h; c; b ] -> { N.degree = whole d; halvings = whole h; cuts = whole c; by_ = cover b } | _ -> wrong "proof"

let tube v = match fields (List.map (( ^ ) "Native.") [ "head"; "more"; "contraction"; "box" ]) v with
  | [ h; m; c; b ] -> { N.head = whole h; more = whole m; contraction = number c; box = vector b } | _ -> wrong "tube"

let defined name of_type rest =
  Option.map (fun rest -> fst (value rest))
    (after [ Word "Definition"; Word name; Sign ":"; Word of_type; Sign ":=" ] rest)

let lemma name rest = Option.map (fun rest -> fst (arguments rest)) (after [ Word ("Native." ^ name) ] rest)

let said theorem holds = Printf.printf "  %s: %s\n" theorem (if holds then "holds" else "NOT DECIDED"); holds

let decide rest =
  match defined "reference" "certificate" rest with
  | None -> wrong "file that states a certificate"
  | Some v ->
    let c = certificate v in
    match lemma "check_sound" rest, lemma "refute_sound" rest with
    | Some [ _; how ], None ->
      said "holds reference" (N.check c (proof how)) &&
      (match defined "disturbed" "disturbance" rest, lemma "check_tube_sound" rest with
       | None, None -> true
       | Some d, Some (_ :: _ :: b :: _) ->
         said "withstands reference disturbed" (N.check_tube c (disturbance d) (tube b))
       | _ -> wrong "disturbed certificate")
    | None, Some [ _; t; k ] -> said "~ holds reference" (N.refute c (number t) (number k).qnum)
    | _ -> wrong "statement with its proof"

let () =
  let files = List.tl (Array.to_list Sys.argv) in
  let decided file =
    let channel = open_in_bin file in
    let text = really_input_string channel (in_channel_length channel) in
    let begun = Sys.time () in
    Printf.printf "%s\n" file;
    let good = try decide (tokens text 0) with Unreadable what -> Printf.printf "  not read: %s\n" what; false in
    Printf.printf "  %.3f s\n%!" (Sys.time () -. begun);
    good in
  exit (if List.for_all Fun.id (List.map decided files) then 0 else 1)
