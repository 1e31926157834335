"""Files of less than 1 MB that would take hours, or gigabytes: each names what is made large.

What is a number in a file can be a count, a length or a power in the check; what is packed, or repeated by an alias,
can be as large as one likes. `measured` checks or reads a file in a process of its own.
"""

import copy
import json
import subprocess
import sys
from collections.abc import Callable
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Chunk, DataEnd, Footer, Header, Message
from mcap.writer import MCAP0_MAGIC

from tests.trackably.checker.edges import hostile
from tests.trackably.checker.instances import scalar_certificate
from tests.trackably.checker.pieces.instances import certificate as of_pieces
from tests.trackably.checker.robust.instances import robust_data
from trackably.checker.__main__ import FAILED, REFUTED, UNDECIDED, UNUSABLE
from trackably.checker.form import read_certificate

Data = dict[str, Any]
TINY = 5e-324
DIGITS = "7" * 1900
KERNEL: Data = {"type": "squared_exponential", "signal_std": 1.0, "lengthscale": 0.3}
_PERIODIC = KERNEL | {"type": "periodic", "period": 1e-30}


MOST_SECONDS, MOST_MEMORY = 4.0, 1_000_000_000
"""What a check of any of these files may take that is given 2 s, and what it may hold [bytes]."""


class Took(NamedTuple):
    """How a command ended, the processor's time [s], and what it held at most [bytes]."""

    code: int
    seconds: float
    memory: int
    said: str


def measured(*arguments: Path | str, command: tuple[str, ...] = ("-m", "trackably", "check")) -> Took:
    """Check a file in a process of its own, or read files with another command."""
    asked = [sys.executable, *command, *map(str, arguments)]
    done = subprocess.run([sys.executable, "-c", _ALONE, *asked], capture_output=True, text=True, check=True)
    code, seconds, memory, said = json.loads(done.stdout)
    return Took(code, seconds, memory * (1 if sys.platform == "darwin" else 1024), said)


_ALONE = """
import json, resource, subprocess, sys
done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([done.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss, done.stderr]))
"""
"""What starts a process in a small one of its own: else the memory of who started it counts as its own."""


def _set(rows: list[list[Any]], dimension: int, size: float = 1) -> Data:
    """Return a set whose rows are bounded by this size."""
    lower, upper = ([end] * len(rows) for end in (-size, size))
    return {"rows": rows, "lower": lower, "upper": upper, "dimension": dimension}


def _first(n: int, count: int = 1) -> list[list[Any]]:
    """Return rows that bound the first of n coordinates."""
    return [[1] + [0] * (n - 1)] * count


def _functional(*weights: list[str]) -> Data:
    """Return a state or an input by the weights of each signal."""
    return {"offset": "0", "weights": [*weights]}


def _linear(n: int, m: int, rows: int = 1, signals: int = 1, shifts: int = 1) -> Data:
    """A certificate of a linear system of this size, whose numbers fit together and prove nothing."""
    functional = _functional(*[["0"] * shifts] * signals)
    bounds = ["x0", *(f"x0 ({i})" for i in range(2, rows + 1))]
    system = {"A": [[0] * n] * n, "B": [[0] * m] * n, "c": [0] * n, "sampling_time": 0.1}
    system |= {"states": [f"x{i}" for i in range(n)], "inputs": [f"u{i}" for i in range(m)]}
    covers = {name: {"ends": [0, 1], "radii": [9]} for name in bounds}
    return {
        "format": "trackably certificate",
        "version": 3,
        "claim": {"kind": "window", "start": 0, "end": 1, "covers": covers, "terms": 8},
        "reference": {
            "signals": [{"kernel": KERNEL, "mean": 0, "centres": [0], "weights": [1]}] * signals,
            "plant": {"system": system, "state_set": _set(_first(n, rows), n, 9), "input_set": _set([], m)},
        },
        "trajectories": {"states": [functional] * n, "inputs": [functional] * m},
        "evaluation": {"until": 1, "errors": dict.fromkeys(bounds, 1e-3)},
    }


def _named(data: Data) -> Data:
    """The same with boxes and errors for all its bounds."""
    names = [bound.name for bound in read_certificate(data).subject.bounds]
    if "covers" in data["claim"]:
        boxes = next(iter(data["claim"]["covers"].values()))
        data["claim"]["covers"] = dict.fromkeys(names, boxes)
    data["evaluation"]["errors"] = dict.fromkeys(names, 1)
    return data


def _system(data: Data) -> Data:
    found: Data = data["reference"]["plant"]["system"]
    return found


def _large_system() -> Data:
    """All weights count: those that are zero cost nothing."""
    data = _linear(100, 100, signals=10, shifts=10)
    _system(data)["A"] = [[0.5] * 100] * 100
    data["trajectories"]["states"] = [_functional(*([f"1/{s + 3}"] * 10 for s in range(10)))] * 100
    return data


def _long_weights() -> Data:
    """Sums of rational numbers with denominators that have nothing in common."""
    data = _linear(60, 1, shifts=2)
    data["trajectories"]["states"] = [_functional([f"1/{DIGITS}{i + 1}", f"1/{DIGITS}{i + 3}1"]) for i in range(60)]
    _system(data)["A"] = [[1] * 60] * 60
    return data


def _wide_floats() -> Data:
    """The null space of a matrix of numbers from 1e-300 to 1e300."""
    data, of = _linear(100, 100), range(100)
    _system(data)["B"] = [
        [float(f"{(i * 37 + j * 61) % 97 + 1}e{(i * 7 + j * 13) % 600 - 300}") for j in of] for i in of
    ]
    data["attainable"] = [{"row": ["1"] * 100, "lower": -1, "upper": 1}]
    data["reference"]["plant"]["input_set"] = _set([[1] * 100], 100)
    return _named(data)


def _attainable() -> Data:
    """Each of many rows of U is compared with each of many attainable rows."""
    data = _linear(1, 2)
    _system(data)["B"] = [[1, TINY]]
    data["reference"]["plant"]["input_set"] = _set([[1, i + 1] for i in range(140)], 2)
    data["attainable"] = [{"row": ["1", str(i)], "lower": -1, "upper": 1} for i in range(1, 8_000)]
    return _named(data)


def _robust(n: int, vector: Callable[[int], list[str]], count: int, power: int, noise: bool = False) -> Data:
    data = _linear(n, 1)
    plant = data["reference"]["plant"]
    zonotope = {"kind": "zonotope", "centre": ["0"] * n, "generators": [vector(i) for i in range(count)]}
    _system(data)["A"] = [[0.1 + 1e-3 * i + 1e-5 * j for j in range(n)] for i in range(n)]
    data["trajectories"]["states"] = [_functional(["0"])] * n
    data["disturbance"] = {
        "state_set": copy.deepcopy(plant["state_set"]),
        "input_set": copy.deepcopy(plant["input_set"]),
        "feedback": [[0] * n],
        "set": zonotope,
        "head": power,
        "terms": power,
        "contraction": 0.5,
        "box": [1e9] * n,
        **({"noise": zonotope} if noise else {}),
    }
    return data


def _steep_powers() -> Data:
    data = _robust(100, lambda i: ["1/3"] * 100, 3, 400)
    _system(data)["A"] = [[TINY] * 100] * 100
    return data


def _many_steps(name: str) -> Data:
    data = copy.deepcopy(robust_data(name))
    data["disturbance"].update(head=10_000, terms=10_000)
    return data


def _pieces(count: int, coefficients: list[float], first: float, beyond: str, claim: Data) -> Data:
    data = copy.deepcopy(of_pieces("end"))
    breakpoints = [first, *(float(i) for i in range(1, count + 1))]
    data["reference"]["signals"] = [
        {"breakpoints": breakpoints, "coefficients": [coefficients] * count, "beyond": beyond}
    ]
    data["claim"], data["evaluation"]["until"] = claim, 1
    return data


def _fine_counterexample() -> Data:
    data = _pieces(3_000, [1] * 100, TINY, "rest", {"kind": "all_times"})
    (name, *_) = data.pop("evaluation")["errors"]
    at = {"quantity": name, "at": {"time": 0.5}, "violation": 1e9}
    return data | {"format": "trackably counterexample", "version": 1} | at


def _high_pieces() -> Data:
    """Near zero, over and over: each bound is halved thousands of times."""
    return _pieces(
        200, [1e-20 * (-1) ** k * (k + 1) for k in range(50)], 0.0, "rest", {"kind": "all_times", "tail_start": 200}
    )


def _with_kernel(kernel: Data, centres: list[float], boxes: int = 1) -> Data:
    data: Data = copy.deepcopy(scalar_certificate())
    data["reference"]["signals"][0] |= {"kernel": kernel, "centres": centres, "weights": [1] * len(centres)}
    cover = {"ends": [i / boxes for i in range(boxes + 1)], "radii": [9] * boxes}
    covers = dict.fromkeys(data["claim"]["covers"], cover)
    data["claim"] = {"kind": "window", "start": 0, "end": 1, "covers": covers, "terms": 64}
    return data


def _nested(kernel: Data, count: int, kind: str = "product") -> Data:
    return hostile.balanced([kernel] * count, lambda left, right: {"type": kind, "left": left, "right": right})


def _matern() -> Data:
    return _named(_with_kernel(KERNEL | {"type": "matern52"}, [i / 512 for i in range(40_000)], boxes=20_000))


def _many_kernels() -> Data:
    data = _linear(1, 1, signals=100)
    kernel = _nested(KERNEL | {"type": "rational_quadratic", "shape": 1}, 90, "sum")
    data["reference"]["signals"] = [{"kernel": kernel, "mean": 0, "centres": [0, 1], "weights": [1, 1]}] * 100
    return data


def _shifted_boxes() -> Data:
    data = _linear(1, 1, signals=100, shifts=100)
    _system(data)["B"] = [[1]]
    for side, weights in (("states", ["1"] * 99 + ["0"]), ("inputs", ["0"] + ["1"] * 99)):
        data["trajectories"][side] = [_functional(*[weights] * 100)]
    data["evaluation"]["errors"]["x0"] = 1
    data["claim"]["covers"]["x0"] = {"ends": [i / 300 for i in range(300)] + [1], "radii": [9] * 300}
    data["claim"]["terms"] = 64
    return data


def _flat(law: object, count: int = 1, **form: object) -> Data:
    """A system with a flat form, of which parts are replaced."""
    data = copy.deepcopy(hostile.tank())
    plant = data["reference"]["plant"]
    plant["system"] |= {
        "f": [law] * count,
        "states": [f"a{i}" for i in range(count)],
        "inputs": ["u"],
        "flat": {"states": ["z1[0]"] * count, "inputs": ["z1[1]"]},
    }
    plant |= {"state_set": _set(_first(count), count), "input_set": _set([[1]], 1)}
    data = _named(data)
    _system(data)["flat"] |= form
    return data


def _turns() -> Data:
    term: object = "a0"
    for _ in range(70):
        term = ["+", term, ["*", 2, "a1"]]
    return _flat(term, 100, angles=[f"a{i}" for i in range(100)])


def _tower(base: object, height: int) -> object:
    for _ in range(height):
        base = ["^", base, 16]
    return base


def _flat_names() -> Data:
    """100 signals with 100 shifts, all in one formula."""

    def total(later: int) -> object:
        terms = [f"z{s}[{j + later}]" for s in range(1, 100) for j in range(0, 98, 2)]
        return hostile.balanced(terms, hostile.added)

    data = _flat("u", states=[total(0)], inputs=[total(1)])
    data["reference"]["signals"] *= 99
    return data


def _sines() -> Data:
    """sin of what has millions of digits before the point, in a box with a huge disc."""
    term: object = "level"
    for _ in range(20):
        term = ["^", ["*", 1e29, ["sin", term]], 64]
    return hostile.with_law(["+", "level", ["*", 0.05, ["+", "inflow", ["*", 1e-30, ["sin", term]]]]])


def _gains() -> Data:
    """Sums of all inputs, times a state, over and over: each product has a part for each input."""
    data = hostile.chain(100)
    system = _system(data)
    sums: object = reduce(hostile.added, (f"u{i}" for i in range(50)))
    for _ in range(45):
        sums = ["*", "x0", sums]
    system["f"] = [sums] * 100
    return data


def _table(rows: int, steps: int) -> Data:
    bounded = _set([[1]] * rows, 1)
    return {
        "format": "trackably table",
        "version": 1,
        "table": {"first_step": 0, "states": [[0]] * steps, "inputs": [[0]] * steps},
        "plant": _linear(1, 1)["reference"]["plant"] | {"state_set": bounded, "input_set": bounded},
        "tolerance": 1,
    }


def _many_denominators() -> Data:
    """Return multipliers of samples whose sum has as many prime factors below its line as there are samples."""
    is_prime, count = bytearray([1]) * 600_000, 45_000
    for i in range(2, 775):
        is_prime[i * i :: i] = bytes(len(is_prime[i * i :: i]))
    primes = [p for p in range(2, len(is_prime)) if is_prime[p]][:count]
    of = {"samples": {"times": [*range(count)], "values": [0] * count, "noise": 1}, "second_derivative": 1}
    return {"format": "trackably contradicted samples", "version": 1, "of": of, "samples": [f"1/{p}" for p in primes]}


def _steps_of_a_large_system() -> Data:
    """Return multipliers for bounds of 100 states at 100 steps: powers of A have long entries."""
    n, steps = 100, 100
    plant = _linear(n, 1)["reference"]["plant"]
    plant["system"] |= {"A": [[1.1 + 1e-10 * (i * j % 7) for j in range(n)] for i in range(n)], "B": [[1]] * n}
    plant |= {"state_set": _set(_first(n), n), "input_set": _set([[1]], 1)}
    proof = {"kind": "multipliers", "states": [[0.3]] * steps, "inputs": [[1]] * steps, "values": []}
    about = {"format": "trackably contradiction", "version": 1, "plant": plant, "start": 0, "steps": steps}
    return about | {"values": [], "missing": 0.1, "proof": proof}


_ALL_TIMES = {"kind": "all_times", "tail_start": 1e4}
_ROOT: object = ["sqrt", ["*", 0, "a0"]]

HUGE: dict[str, Callable[[], Data]] = {
    "many rows of many weights": lambda: _linear(1, 1, rows=5_000, signals=100, shifts=100),
    "a large system": _large_system,
    "long rational weights": _long_weights,
    "floats of all sizes in B": _wide_floats,
    "many attainable rows": _attainable,
    "powers of A + B K": lambda: _robust(30, lambda i: ["1/3"] * 30, 3, 10_000),
    "powers of a tiny A + B K": _steep_powers,
    "long disturbances": lambda: _robust(2, lambda i: [f"1/{DIGITS}{2 * i + 1}", "1"], 200, 10),
    "disturbances of 19,000 digits": lambda: _robust(2, lambda i: [f"1/{'7' * 19_000}{2 * i + 1}", "1"], 40, 10),
    "many disturbances": lambda: _robust(2, lambda i: ["1", f"1/{DIGITS}{i}" if i < 40 else "1"], 10_000, 10),
    "much noise": lambda: _robust(40, lambda i: ["1"] * 40, 2_000, 10, noise=True),
    "N and s of a cart": lambda: _many_steps("pushed cart"),
    "N and s with noise": lambda: _many_steps("noisy cart"),
    "endless periods": lambda: _pieces(1, [0.0], 0.0, "period", {"kind": "window", "start": 0, "end": 1e30}),
    "pieces with a tiny breakpoint": lambda: _pieces(5_000, [1] * 50, TINY, "rest", _ALL_TIMES),
    "a counterexample of such pieces": _fine_counterexample,
    "pieces of degree 49": _high_pieces,
    "a product of 100 kernels": lambda: _with_kernel(_nested(KERNEL, 100), [0] * 200_000),
    "a product of 100 periodic kernels": lambda: _with_kernel(_nested(_PERIODIC, 100), [0] * 200_000),
    "Matérn kernels in many boxes": _matern,
    "10,000 kernels": _many_kernels,
    "10,000 shifted signals in boxes": _shifted_boxes,
    "10,000 shifted signals at instants": lambda: (
        _shifted_boxes() | {"claim": {"kind": "instants", "last_step": 500_000}}
    ),
    "100 angles": _turns,
    # 0.1^16^16…: seven powers have as many digits as there is memory.
    "a tower of a number": lambda: _flat(["+", "u", ["*", 0, _tower(0.1, 12)]]),
    "a tower of a signal": lambda: _flat(["+", "u", ["/", ["-", _tower("a0", 20), 1], ["-", "a0", 1]]]),
    "a tower of a root of zero": lambda: _flat(["+", "u", _tower(_ROOT, 20)]),
    "5,000 shifted signals in a flat form": _flat_names,
    "sines of huge numbers": _sines,
    "products of many inputs": _gains,
    "a table of many rows": lambda: _table(10_000, 50_000),
    "many denominators of multipliers": _many_denominators,
    "steps of a large system": _steps_of_a_large_system,
    "a tower of powers": lambda: hostile.tower(20),
}
"""What would take long, or much, by what is large in it."""


def answers(what: str) -> tuple[int, ...]:
    """Return the codes of the answers that are right: nothing is proved, and only what is true may be refuted."""
    is_true = what == "a counterexample of such pieces"  # z(0.5) is 2, far beyond every bound
    return (FAILED, UNUSABLE, UNDECIDED, REFUTED) if is_true else (FAILED, UNUSABLE, UNDECIDED)


def write(data: Data, path: Path) -> Path:
    """Write a file without spaces."""
    path.write_text(json.dumps(data, separators=(",", ":")))
    assert path.stat().st_size < 10**6, path.stat().st_size
    return path


Write = Callable[[Path], object]
Pack = tuple[Callable[[bytes], bytes], str]
"""How data are packed, and what that is called."""


def _mcap(data: bytes, size: int = 1, pack: Pack = (bytes, ""), count: int = 1, **more: int) -> Write:
    """Write messages, each of data that is repeated, in chunks that are packed; `times` over.

    It is whole in all that a reader can see before it unpacks the chunks, but for the size that these `say`.
    """

    def write(path: Path) -> None:
        inner, outer = RecordBuilder(), RecordBuilder()
        Channel(1, "/x", "json", {}, 0).write(inner)
        for i in range(count):
            Message(1, i, data * size, i, i).write(inner)
        content, (packed, name) = inner.end(), pack
        Header("", "").write(outer)
        for _ in range(more.get("times", 1)):
            Chunk(name, packed(content), 0, 0, 0, more.get("say", len(content))).write(outer)
        DataEnd(0).write(outer)
        Footer(0, 0, 0).write(outer)
        path.write_bytes(MCAP0_MAGIC + outer.end() + MCAP0_MAGIC)

    return write


def _message(text: str) -> Write:
    return _mcap(f'{{"t": 1, "x": {text}}}'.encode())


class Packed(NamedTuple):
    """A recording, or the file of a system: its `name`, what writes it, and what its refusal `says`."""

    name: str
    write: Write
    says: str


_ZSTD: Pack = (zstandard.ZstdCompressor(level=19).compress, "zstd")
_LZ4: Pack = (lz4.frame.compress, "lz4")

_YAML = "system: {A: [[0]], B: [[1]], sampling_time: 1, c: *l8}\nstate_set: null\ninput_set: null\n"
_LAUGHS = "l0: &l0 [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]\n" + "".join(
    f"l{i}: &l{i} [{', '.join([f'*l{i - 1}'] * 10)}]\n" for i in range(1, 9)
)

RECORDINGS: dict[str, Packed] = {
    "a zstd chunk": Packed("x.mcap", _mcap(b"1", 200_000_000, _ZSTD), "a chunk has 20"),
    "an lz4 chunk": Packed("x.mcap", _mcap(b"1", 120_000_000, _LZ4), "a chunk has 12"),
    "a zstd chunk that lies": Packed(
        "x.mcap", _mcap(b"1", 200_000_000, _ZSTD, say=1000), "not unpack to the 1000 bytes"
    ),
    "an lz4 chunk that lies": Packed(
        "x.mcap", _mcap(b"1", 120_000_000, _LZ4, say=1000), "not unpack to the 1000 bytes"
    ),
    "many zstd chunks": Packed("x.mcap", _mcap(b"1", 100_000, _ZSTD, count=100, times=60), "take more than"),
    "a value 1e99999999": Packed("x.mcap", _message("1e99999999"), "expected a finite number, got 1E+99999999"),
    "a value 1e999999": Packed("x.mcap", _message("1e999999"), "expected a finite number, got 1E+999999"),
    "a value of many digits": Packed("x.mcap", _message("0." + "1" * 500_000), "expected a finite number, got 0.111"),
    "a deep message": Packed("x.mcap", _message("[" * 300_000), "cannot be decoded"),
    "aliases of aliases": Packed("x.yaml", lambda p: p.write_text(_LAUGHS + _YAML), "counted as often as"),
    "deep YAML": Packed("x.yaml", lambda p: p.write_text("[" * 100_000), "nested more than 100 deep"),
    "a long number in CSV": Packed(
        "x.csv",
        lambda p: p.write_text(f"t,x\n1e9999,1\n{'9' * 100_000},2\n"),
        "expected a finite number, got '1e9999' of more than 1000 digits",
    ),
}
"""What unpacks, or is written out, to gigabytes: by what is large in it."""

READ = """
import sys
from pathlib import Path
from trackably.errors import InputError
from trackably.given.command import read_plant
from trackably.recordings import read_csv
from trackably.recordings.mcap_file import Field, Stamp, read_mcap

def refusal(read, *of):
    try:
        read(*of)
    except InputError as error:
        assert len(str(error)) < 400
        return str(error)

for path in map(Path, sys.argv[1:]):
    if path.suffix == ".yaml":
        said = refusal(read_plant, path)
    elif path.suffix == ".mcap":
        said = [refusal(read_mcap, path, {"x": Field("/x", "x", time=Stamp(of, "s"))}) for of in "xt"][-1]
    else:
        said = refusal(read_csv, path, "t", "s", {"x": "x"})
    print(said, file=sys.stderr)
sys.exit(1)
"""
"""Read files as a user would; an InputError is one short sentence."""
