"""Read the content of files strictly: exactly the known fields, numbers exact in float64, and no conversions.

A reader is a function of a value and the value's place in the file; its error messages name the place. Readers of
objects are built from readers of their fields. No name can be mistaken for a part of a sentence, so that printed
statements mean what they seem to say.
"""

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, fields
from fractions import Fraction
from functools import cache, partial
from itertools import pairwise
from reprlib import Repr
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from trackably.checker import certificate as proofs
from trackably.checker.certificate import (
    KINDS,
    Boxes,
    Certificate,
    Claim,
    Cover,
    Instants,
    Steps,
    Terms,
    TrueSignal,
    Window,
)
from trackably.checker.disturbances import Robust
from trackably.checker.formulas import (
    FUNCTIONS,
    IDENTIFIER,
    LETTER,
    SYMBOLS,
    Angle,
    Formula,
    Function,
    Name,
    Number,
    Operation,
    Power,
    parts,
)
from trackably.checker.kernels import COMBINATIONS, ELEMENTARY, Combination, Kernel
from trackably.checker.limits import (
    CENTRES,
    COEFFICIENTS,
    COORDINATES,
    DEPTH,
    DIGITS,
    INSTANTS,
    KERNEL_DEPTH,
    KERNELS,
    MAY_BE_EMPTY,
    PARTS,
    ROWS,
    SIGNALS,
    TEXTS,
)
from trackably.checker.model_error import Vector
from trackably.checker.subject import (
    Beyond,
    End,
    Functional,
    LinearSystem,
    NonlinearSystem,
    Pieces,
    Plant,
    Polytope,
    Positive,
    Row,
    Signal,
    Subject,
    System,
    Trajectories,
)
from trackably.checker.watch import tick

T = TypeVar("T")
U = TypeVar("U")
Reader = Callable[[object, str], T]
"""Reads a decoded JSON value; the second argument is its place in the file, which error messages name."""

FORMER_NAME = "trackable"
"""The library's former name, in the format of its first certificates, which remain readable."""


class _Short(Repr):
    def repr_int(self, x: int, level: int) -> str:
        try:
            return super().repr_int(x, level)
        except ValueError:  # Python refuses to write integers of more than 4,300 digits
            return f"an integer of {x.bit_length()} bits"


short = _Short().repr
"""Returns a value as a short text for messages, whatever its size."""


class UnreadableError(ValueError):
    """The data is no file that the checker knows; the message names the first missing, unknown or wrong part."""


def format_of(data: object) -> str | None:
    """Return the format of a file, with the library's former name replaced by the current one; None if none."""
    found = data.get("format") if isinstance(data, dict) else None
    if not isinstance(found, str):
        return None
    return f"trackably {rest}" if (rest := found.removeprefix(f"{FORMER_NAME} ")) != found else found


def from_json(data: bytes) -> object:
    """Return the decoded JSON in `data`. ValueError: no UTF-8, no JSON, NaN, infinity, or a key twice in an object."""
    try:
        content: object = _DECODER.decode(data.decode())
    except (ValueError, RecursionError) as error:
        raise ValueError(f"expected JSON: {error}") from error
    return content


def _refuse_constant(name: str) -> object:
    raise ValueError(f"{name} is no JSON number")


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    found: dict[str, object] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"key {short(key)} appears twice in one object")
        found[key] = value
    return found


# The decoder is built only once, because each of the many messages of a log is decoded separately.
_DECODER = json.JSONDecoder(parse_constant=_refuse_constant, object_pairs_hook=_unique)


def require_short_texts(data: object) -> None:
    """Raise UnreadableError if the texts of a file, without names of fields, have more than `TEXTS` characters."""
    waiting, found = [data], 0
    while waiting:
        tick()
        inner = waiting.pop()
        for value in inner.values() if isinstance(inner, dict) else inner if isinstance(inner, list) else ():
            if isinstance(value, str):
                found += len(value)
            elif isinstance(value, dict | list):
                waiting.append(value)
        if found > TEXTS:
            raise UnreadableError(f"all texts of the file together must have no more than {TEXTS} characters")


# Readers of objects and lists.


def record(
    make: Callable[..., T], optional: Mapping[str, Reader[Any]] | None = None, /, **readers: Reader[Any]
) -> Reader[T]:
    """Return a reader of objects, which returns `make` of the values of their fields.

    An object must have all fields in `readers`, may have those in `optional`, and must have no others.
    """
    every = {**readers, **(optional or {})}

    def read(value: object, where: str) -> T:
        if not isinstance(value, dict) or not readers.keys() <= value.keys() <= every.keys():
            raise UnreadableError(
                f"{where} must be an object with the fields {', '.join(readers)}"
                f"{' and perhaps ' + ', '.join(optional) if optional else ''}, and no others, got "
                f"{short([*value] if isinstance(value, dict) else value)}"
            )
        return make(**{name: reader(value[name], f"{where}.{name}") for name, reader in every.items() if name in value})

    return read


def by_tag(tag: str, readers: Mapping[str, Reader[T]]) -> Reader[T]:
    """Return a reader of objects; the text in the field `tag` of an object selects one of the `readers` for it."""

    def read(value: object, where: str) -> T:
        kind = value.get(tag) if isinstance(value, dict) else None
        if not isinstance(value, dict) or not isinstance(kind, str) or kind not in readers:
            raise UnreadableError(f"{where}.{tag} must be one of {', '.join(readers)}, got {short(kind)}")
        return readers[kind]({name: inner for name, inner in value.items() if name != tag}, where)

    return read


def many(reader: Reader[T], most: int, empty: bool = False) -> Reader[tuple[T, ...]]:
    """Return a reader of lists with at most `most` values; a list must not be empty unless `empty` is set."""

    def read(value: object, where: str) -> tuple[T, ...]:
        if not isinstance(value, list) or not (value or empty):
            raise UnreadableError(f"{where} must be a list{'' if empty else ', not empty'}, got {short(value)}")
        if len(value) > most:
            raise UnreadableError(f"{where} must have no more than {most} entries, got {len(value)}")
        return tuple([reader(item, f"{where}[{i}]") for i, item in enumerate(value)])

    return read


def a_pair(first: Reader[T], second: Reader[U]) -> Reader[tuple[T, U]]:
    """Return a reader of lists of two values."""

    def read(value: object, where: str) -> tuple[T, U]:
        if not isinstance(value, list) or len(value) != 2:
            raise UnreadableError(f"{where} must be a list of two values, got {short(value)}")
        return first(value[0], f"{where}[0]"), second(value[1], f"{where}[1]")

    return read


def by_name(a_name: Reader[str], reader: Reader[T]) -> Reader[dict[str, T]]:
    """Return a reader of objects with any keys, which `a_name` reads, and values, which `reader` reads."""

    def read(value: object, where: str) -> dict[str, T]:
        if not isinstance(value, dict):
            raise UnreadableError(f"{where} must be an object, got {short(value)}")
        return {a_name(name, where): reader(item, f"{where}.{name}") for name, item in value.items()}

    return read


def one_of(known: Iterable[T]) -> Reader[T]:
    """Return a reader that accepts only the `known` values."""
    every = list(known)

    def read(value: object, where: str) -> T:
        for one in every:
            if value == one:
                return one
        raise UnreadableError(f"{where} must be one of {', '.join(map(str, every))}, got {short(value)}")

    return read


def located(value: object, where: str) -> tuple[object, str]:
    """Return a value unchanged, to be read later, and its place in the file."""
    return value, where


def file_of(kind: str, version: int, reader: Reader[T], hint: str = "") -> Callable[[Mapping[Any, object]], T]:
    """Return a reader of the content of files of a kind and version. It raises UnreadableError for other content.

    `hint` ends the message about a file of another version, and says what to do about it.
    """

    def read(data: Mapping[Any, object]) -> T:
        found = data.get("version")
        if type(found) is not int or found != version:
            raise UnreadableError(f"is a {kind} of version {short(found)}; this checker reads version {version}{hint}")
        content = {name: value for name, value in data.items() if name not in ("format", "version")}
        try:
            return reader(content, kind)
        except UnreadableError as error:
            raise UnreadableError(f"is not a {kind}: {error}") from error

    return read


# Readers of numbers and names.


def real_number(value: object, where: str) -> float:
    """Read a finite number that float64 holds exactly."""
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not abs(value) < 2**1023
        or float(value) != value
    ):
        raise UnreadableError(f"{where} must be a finite number, exact in float64, got {short(value)}")
    return float(value)


def positive_number(value: object, where: str) -> float:
    """Read a positive number."""
    number = real_number(value, where)
    if not number > 0:
        raise UnreadableError(f"{where} must be positive, got {number!r}")
    return number


def exact_number(value: object, where: str) -> Fraction:
    """Read a float64 as the rational number that it is."""
    return Fraction(real_number(value, where))


def whole_number(most: int, least: int = 1) -> Reader[int]:
    """Return a reader of whole numbers from `least` to `most`, both included."""

    def read(value: object, where: str) -> int:
        if type(value) is not int or not least <= value <= most:
            raise UnreadableError(
                f"{where} must be a whole number, {least} at least and {most} at most, got {short(value)}"
            )
        return value

    return read


def _text(pattern: str, described: str) -> Reader[str]:
    """Return a reader of texts that a regular expression matches as a whole."""
    compiled = re.compile(pattern)

    def read(value: object, where: str) -> str:
        if not isinstance(value, str) or not compiled.fullmatch(value):
            raise UnreadableError(f"{where} must be {described}, got {short(value)}")
        return value

    return read


_ratio = _text(
    rf"(?!.{{{DIGITS + 1}}})-?[0-9]+(/0*[1-9][0-9]*)?",
    f"a rational number in a text such as '-3/4', of {DIGITS} characters at most",
)


def rational_number(value: object, where: str) -> Fraction:
    """Read a rational number from a text such as -3/4."""
    tick()
    numerator, _, denominator = _ratio(value, where).partition("/")
    return Fraction(int(numerator), int(denominator or "1"))


an_identifier = _text(
    IDENTIFIER,
    "a name: a letter or _, then letters, digits, _ and -, then indices or units in brackets, 60 characters at most",
)
"""Reads the name of a state or an input."""

a_bound = _text(
    rf"[{LETTER}µ0-9₀-₉²³¹⁻_/·*^°%()\[\].+ …-]{{1,100}}",
    "the name of a bound, such as x, x-0.5y or x (2)",
)
"""Reads the name of a bound: a weighted sum of names, such as x-0.5y; x (2) is the second bound of x."""


# Readers of kernels and formulas, which are nested.


def a_kernel(value: object, where: str) -> Kernel:
    """Read a kernel: an object with its type, and either positive hyperparameters, or the two kernels it combines."""
    found = _nested_kernel(value, where)
    if (count := _count(found)) > KERNELS:
        raise UnreadableError(f"{where} must be made of no more than {KERNELS} kernels, got {count}")
    return found


def _count(kernel: Kernel) -> int:
    return _count(kernel.left) + _count(kernel.right) if isinstance(kernel, Combination) else 1


_elementary: dict[str, Reader[Kernel]] = {
    name: record(family, **{field.name: positive_number for field in fields(family)})
    for name, family in ELEMENTARY.items()
}


def _nested_kernel(value: object, where: str, deepest: int = KERNEL_DEPTH) -> Kernel:
    if deepest < 0:
        raise UnreadableError(f"{where} must not be nested more than {KERNEL_DEPTH} deep")
    part = partial(_nested_kernel, deepest=deepest - 1)
    both = {name: record(family, left=part, right=part) for name, family in COMBINATIONS.items()}
    return by_tag("type", _elementary | both)(value, where)


def a_formula(value: object, where: str, deepest: int = DEPTH) -> Formula:
    """Read a formula: a number, a name, or a list of an operator or a function and its operands, which are formulas.

    The lists are [∘, a, b] with ∘ among + - * /, ["^", a, number], [function, a] and ["atan2", y, x].
    """
    if not isinstance(value, list):
        return Name(an_identifier(value, where)) if isinstance(value, str) else Number(real_number(value, where))
    if not deepest:
        raise UnreadableError(f"{where} must not be nested more than {DEPTH} deep")
    inner = partial(a_formula, where=where, deepest=deepest - 1)
    match value:
        case ["^", base, exponent]:
            return Power(inner(base), real_number(exponent, where))
        case ["atan2", y, x]:
            return Angle(inner(y), inner(x))
        case [symbol, left, right] if symbol in SYMBOLS:
            return Operation(symbol, inner(left), inner(right))
        case [function, argument] if function in FUNCTIONS:
            return Function(function, inner(argument))
    raise UnreadableError(
        f'{where} must be a formula: [∘, a, b] with ∘ among + - * / ^, ["atan2", y, x], or [f, a] with f among '
        f"{', '.join(FUNCTIONS)}, got {short(value)}"
    )


# Readers of the subject of a file: a reference, its system and its sets.


def a_system(value: object, where: str) -> System:
    """Read a system; it is nonlinear if it has formulas f."""
    if not (isinstance(value, dict) and "f" in value):
        linear: LinearSystem = reader_of(LinearSystem)(value, where)
        return linear
    found: NonlinearSystem = reader_of(NonlinearSystem)(value, where)
    of_flat = (*found.flat.states, *found.flat.inputs, *found.flat.positive) if found.flat else ()
    if sum(len(parts(formula)) for formula in (*found.f, *of_flat)) > PARTS:
        raise UnreadableError(f"{where} must have no more than {PARTS} operations, names and numbers in its formulas")
    return found


def _end(value: object, where: str) -> End:
    """Read an end of a bound: a number, or polynomial pieces if the end moves in time."""
    return _pieces_beyond("rest", "period")(value, where) if isinstance(value, dict) else real_number(value, where)


_ends = many(_end, ROWS, empty=True)


def _polytope(
    rows: tuple[tuple[Fraction, ...], ...], lower: tuple[End, ...], upper: tuple[End, ...], dimension: int
) -> Polytope:
    if not len(rows) == len(lower) == len(upper):
        raise UnreadableError(
            f"a set must have a lower and an upper bound for each row, got {len(lower)} and {len(upper)} for "
            f"{len(rows)} rows"
        )
    return Polytope(tuple(map(Row, rows, lower, upper)), dimension)


_set = record(
    _polytope,
    rows=many(many(exact_number, COORDINATES), ROWS, empty=True),
    lower=_ends,
    upper=_ends,
    dimension=whole_number(COORDINATES),
)


def _valid_pieces(**found: Any) -> Pieces:
    pieces = Pieces(**found)
    if len(pieces.breakpoints) != len(pieces.coefficients) + 1:
        count = len(pieces.coefficients)
        raise UnreadableError(
            f"pieces: expected {count + 1} breakpoints for {count} pieces, got {len(pieces.breakpoints)}"
        )
    if any(len(row) != pieces.degree + 1 for row in pieces.coefficients):
        raise UnreadableError("pieces: all pieces must have the same number of coefficients")
    if not all(before < after for before, after in pairwise(pieces.breakpoints)):
        raise UnreadableError("pieces: breakpoints must increase")
    return pieces


def _pieces_beyond(*kinds: Beyond) -> Reader[Pieces]:
    return record(
        _valid_pieces,
        breakpoints=many(real_number, CENTRES),
        coefficients=many(many(real_number, COEFFICIENTS), CENTRES),
        beyond=one_of(kinds),
    )


_pieces = _pieces_beyond("rest", "period", "end")


def has_pieces(signals: object) -> bool:
    """Return whether a file's signals are polynomial pieces."""
    return isinstance(signals, list) and any(isinstance(one, dict) and "breakpoints" in one for one in signals)


def _signals(value: object, where: str) -> tuple[tuple[Signal, ...], tuple[Pieces, ...]]:
    """Read signals: either all are sums of kernels, or all are polynomial pieces."""
    if has_pieces(value):
        return (), many(_pieces, SIGNALS)(value, where)
    return many(reader_of(Signal), SIGNALS)(value, where), ()


# Readers that follow from types.

_READERS: dict[Any, Reader[Any]] = {
    float: real_number,
    Positive: positive_number,
    Fraction: rational_number,
    str: an_identifier,
    Formula: a_formula,
    Kernel: a_kernel,
    System: a_system,
    Polytope: _set,
}


@cache
def reader_of(kind: Any) -> Reader[Any]:
    """Return the reader of a type, which is a key of `_READERS`, or one of the following.

    Annotated[int, most, least] is a whole number. Annotated[tuple[T, ...], most] is a list of at most this length, not
    empty unless MAY_BE_EMPTY is the second annotation; tuple[T, U] is a list of two values. Literal is one of some
    values. A dataclass is an object with its fields; those with a default may be left out. In a union of dataclasses,
    the field "kind" of an object says which one it is. T | None is T in a field that may be left out.
    """
    if kind in _READERS:
        return _READERS[kind]
    inner, origin = [of for of in get_args(kind) if of is not type(None)], get_origin(kind)
    if origin is Annotated:
        of, *limits = inner
        return whole_number(*limits) if of is int else many(reader_of(get_args(of)[0]), *limits)
    if origin is tuple:
        return a_pair(*map(reader_of, inner))
    if origin is Literal:
        return one_of(inner)
    if inner:
        return by_tag("kind", {of.kind: reader_of(of) for of in inner}) if inner[1:] else reader_of(inner[0])
    hints = get_type_hints(kind, include_extras=True)
    readers = {field.name: reader_of(hints[field.name]) for field in fields(kind)}
    optional = {field.name: readers.pop(field.name) for field in fields(kind) if field.default is not MISSING}
    return record(kind, optional, **readers)


a_plant: Reader[Plant] = reader_of(Plant)
"""Reads a system with its sets, whose bounds may move in time."""

_reference: Reader[dict[str, Any]] = record(dict, signals=_signals, plant=a_plant)
_row = record(
    lambda row, lower, upper: Row(row, low=lower, high=upper),
    row=reader_of(Vector),
    lower=real_number,
    upper=real_number,
)
of_linear = {"trajectories": reader_of(Trajectories), "attainable": many(_row, ROWS, MAY_BE_EMPTY)}


def subject_from(
    reference: tuple[Any, str], trajectories: Trajectories | None = None, attainable: tuple[Row, ...] | None = None
) -> Subject:
    """Return the subject of a file: a reference with its system and sets.

    `reference` is the object in the file that describes them, with its place; the fingerprint is made of this object.
    """
    written, where = reference
    found = _reference(written, where)
    plant: Plant = found["plant"]
    signals, pieces = found["signals"]
    is_linear = isinstance(plant.system, LinearSystem)
    if is_linear != (trajectories is not None) or (attainable is not None and not is_linear):
        raise UnreadableError(
            "trajectories: expected for a linear system, perhaps with `attainable`; a nonlinear one must have neither"
        )
    if pieces and not is_linear:
        raise UnreadableError("pieces: states and inputs of polynomial pieces are read for linear systems only")
    known = fingerprint(written["signals"], written["plant"]["system"], trajectories)
    return Subject(
        **vars(plant),
        signals=signals,
        trajectories=trajectories,
        attainable=attainable,
        fingerprint=known,
        pieces=pieces,
    )


def subject_of(data: Mapping[str, object]) -> Subject:
    """Return the subject (reference, system and sets) of a file from its content; UnreadableError if there is none."""
    about = {name: data[name] for name in ("reference", *of_linear) if name in data}
    return record(subject_from, of_linear, reference=located)(about, "subject")


def fingerprint(signals: object, system: object, trajectories: Trajectories | None) -> str:
    """Return the SHA-256 of the canonical form of signals, system and trajectories, as 64 hexadecimal digits.

    The canonical form is the JSON of {"signals", "system", "trajectories"} in UTF-8, with sorted keys, without spaces,
    and with every number as the shortest decimal that float64 reads as it (Python's `repr`), where −0 is 0. Rational
    numbers are texts in lowest terms and hexadecimal digits, such as "-3/a", and trailing zeros among the weights of a
    signal are left out. Nonlinear systems have no "trajectories".
    """
    content = {"signals": signals, "system": system}
    if trajectories:
        content["trajectories"] = {"states": _exact(trajectories.states), "inputs": _exact(trajectories.inputs)}
    floats = json.loads(json.dumps(content), parse_int=float, parse_float=lambda digits: float(digits) + 0.0)
    canonical = json.dumps(floats, ensure_ascii=False, separators=(",", ":"), sort_keys=True)
    return hashlib.sha256(canonical.encode()).hexdigest()


def _exact(functionals: tuple[Functional, ...]) -> list[object]:
    def digits(number: Fraction) -> str:
        return f"{number.numerator:x}/{number.denominator:x}"

    return [
        {
            "offset": digits(of.offset),
            "weights": [[digits(w) for j, w in enumerate(weights) if any(weights[j:])] for weights in of.weights],
        }
        for of in functionals
    ]


# Readers of certificates.


_cover: dict[str, Reader[Any]] = {"covers": by_name(a_bound, reader_of(Boxes)), "terms": reader_of(Terms)}
Stated = tuple[Claim, Cover | Steps]


_ENDS: dict[str, dict[str, Reader[float]]] = {
    "all_times": {"tail_start": positive_number},
    "all_phases": {"period": positive_number},
    "window": {"start": real_number, "end": real_number},
}


def _covered(
    of: Callable[..., Claim],
    covers: Mapping[str, Boxes] | None = None,
    terms: int = 0,
    start: float = 0.0,
    **ends: float,
) -> Stated:
    if (covers is None) == bool(terms):
        raise UnreadableError("certificate.claim must have both `covers` and `terms`, or neither")
    (end,) = ends.values()
    return of(start, end) if of is Window else of(), Cover(start, end, covers or {}, terms)


_instants: Reader[Stated] = record(lambda last_step: (Instants(), Steps(last_step)), last_step=whole_number(INSTANTS))
_real_times = {kind: record(partial(_covered, KINDS[kind]), _cover, **ends) for kind, ends in _ENDS.items()}
_claim = by_tag("kind", {**_real_times, "instants": _instants})


def _certificate(
    claim: Stated,
    evaluation: dict[str, Any],
    disturbance: Robust | None = None,
    truth: tuple[TrueSignal, ...] = (),
    **about: Any,
) -> Certificate:
    subject = subject_from(**about)
    if disturbance and not isinstance(subject.system, LinearSystem):
        raise UnreadableError("disturbance: this field is for linear systems only")
    proof = claim[1]
    if bool(subject.pieces) == (isinstance(proof, Steps) or bool(proof.terms)):
        raise UnreadableError(
            "certificate.claim must have `covers` and `terms`; for polynomial pieces neither, and no kind `instants`"
        )
    return Certificate(subject, *claim, **evaluation, robust=disturbance, truth=truth)


read_certificate = file_of(
    "certificate",
    proofs.VERSION,
    record(
        _certificate,
        {**of_linear, "disturbance": reader_of(Robust), "truth": many(reader_of(TrueSignal), COORDINATES)},
        claim=_claim,
        reference=located,
        evaluation=record(dict, until=positive_number, errors=by_name(a_bound, positive_number)),
    ),
    ": prove the reference again to get one",
)
