"""Certificates judged twice, by the checker and by an earlier prover: `python -m tests.attack.opponent --files 10000`.

That prover was rigorous by itself, with ball arithmetic of its own (python-flint). It is taken from the history of the
repository into a temporary folder, reads the reference and the claim of a file, and makes a proof or a counterexample
of its own: what one of both proves, the other must not refute. All other differences are counted with the reason that
is given.
"""

import copy
import importlib
import json
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, fields, is_dataclass
from itertools import chain, count, islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tests.attack.command import run
from tests.attack.references import FAMILIES, answer
from tests.attack.tampering import random_change
from tests.splines.draws import drawn
from tests.splines.trials import _bounded
from tests.trackably.certificates.decoded import as_read
from trackably.certificates.certificate import Certificate
from trackably.certificates.outcome import Counterexample
from trackably.certificates.prove import Outcome, prove
from trackably.checker import NotACertificate, Proved, Refuted, Undecided, check
from trackably.checker.certificate import Window
from trackably.codec import decode
from trackably.systems.reference import Reference

COMMIT = "8d027f1"
"""The last one whose prover was rigorous by itself; the library was called `trackable` then."""

SECONDS = 5
"""That either of them may take for one file."""

_TAMPERED = 4  # of each file
PROVED, REFUTED, NEITHER, UNREADABLE, LATE = "proved", "refuted", "neither", "unreadable", "not in time"


class _LateError(Exception):
    pass


@dataclass
class Differences:
    """How often what is said of which kind of file, by the checker and by the opponent, and why where they differ."""

    counts: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    reasons: Counter[tuple[str, str, str]] = field(default_factory=Counter)
    false: list[str] = field(default_factory=list)

    def add(self, kind: str, of_checker: tuple[str, str], of_opponent: tuple[str, str], what: str) -> None:
        (one, why), (other, because) = of_checker, of_opponent
        self.counts[kind, one, other] += 1
        if {one, other} == {PROVED, REFUTED}:
            self.false.append(f"{what}: the checker says {one}, the opponent {other}: {why} {because}")
        elif one != other:
            self.reasons[one, other, why if one in (NEITHER, UNREADABLE, LATE) else because] += 1

    @property
    def table(self) -> str:
        lines = ["| file | checker | opponent | count |", "|---|---|---|--:|"]
        lines += [f"| {' | '.join(key)} | {count} |" for key, count in sorted(self.counts.items())]
        lines += ["", "| checker | opponent | why they differ | count |", "|---|---|---|--:|"]
        lines += [f"| {' | '.join(key)} | {count} |" for key, count in self.reasons.most_common()]
        return "\n".join(lines)


def judge_twice(files: int, seed: int) -> tuple[str, list[str]]:
    """Judge so many files, or as many as there are before an interrupt (Ctrl-C)."""
    found = Differences()
    with TemporaryDirectory() as folder, suppress(KeyboardInterrupt):
        opponent = Opponent.of(Path(folder))
        for what, kind, data in islice(chain.from_iterable(_files(seed, number) for number in count()), files):
            found.add(kind, _checked(data), opponent.says(data), what)
    return f"\n{found.table}", found.false


def _files(seed: int, number: int) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield a certificate or counterexample of a random reference, and some that were changed."""
    rng = np.random.default_rng((seed, number, 2))
    outcome = _outcome(seed, number, rng)
    if not isinstance(outcome, Certificate | Counterexample):
        return
    kind, data = PROVED if isinstance(outcome, Certificate) else REFUTED, as_read(outcome)
    yield f"{seed} {number}", kind, data
    for i in range(_TAMPERED):
        done, changed = random_change(copy.deepcopy(data), rng)
        yield f"{seed} {number} {i}: {done}", f"{kind}, then changed", changed


def _outcome(seed: int, number: int, rng: np.random.Generator) -> Outcome:
    if number % 5 < len(FAMILIES):
        return answer(number, list(FAMILIES.values())[number % 5](10**6 * (seed + 1) + number))
    given = drawn(seed, number)
    quantity = given.reference.quantities[int(rng.integers(len(given.reference.quantities)))]
    last = max(float(z.breakpoints[-1]) for z in given.reference.pieces)
    values = quantity([z.summed for z in given.reference.pieces], np.linspace(*(given.window or (0.0, last)), 4001))
    low, high = float(values.min()), float(values.max())
    off = (high - low) * float(rng.choice([-1, 1])) * 10 ** rng.uniform(-9, -2)
    bounded = _bounded(given, quantity.name, low - (high - low), high + off)
    return prove(bounded, Window(*given.window)) if given.window else prove(bounded)


def _checked(data: dict[str, Any]) -> tuple[str, str]:
    match check(data, SECONDS):
        case Proved():
            return PROVED, ""
        case Refuted():
            return REFUTED, ""
        case Undecided():
            return LATE, "the checker takes too long"
        case NotACertificate():
            return UNREADABLE, "it is no file of the checker's form"
        case failed:
            return NEITHER, failed.reason.partition(":")[0]


@dataclass
class Opponent:
    """The earlier prover, which lives beside today's library, as its package has another name."""

    prover: Any
    classes: dict[str, Any]
    known: dict[str, tuple[str, str]] = field(default_factory=dict)

    @classmethod
    def of(cls, folder: Path) -> "Opponent":
        """Take it from the repository's history. CalledProcessError: the history does not reach back so far."""
        root = Path(__file__).parents[2]
        packed = subprocess.run(["git", "archive", COMMIT, "trackable"], cwd=root, check=True, capture_output=True)
        subprocess.run(["tar", "-x", "-C", str(folder)], input=packed.stdout, check=True)
        sys.path.append(str(folder))
        prover = importlib.import_module("trackable.certificates.prove")
        loaded = [vars(module).values() for name, module in sys.modules.items() if name.startswith("trackable.")]
        classes = [of for every in loaded for of in every if isinstance(of, type) and is_dataclass(of)]
        return cls(prover, {_named(of): of for of in classes})

    def says(self, data: dict[str, Any]) -> tuple[str, str]:
        """Return what it says of the claim about the reference, and why."""
        try:
            about = json.dumps([data["reference"], {k: v for k, v in data["claim"].items() if k not in _PROOF}])
        except (KeyError, AttributeError, TypeError, ValueError):
            return UNREADABLE, "it has no reference or no claim"
        if about not in self.known:
            self.known = {about: self._said(data)}  # of the last one only: files that follow are about the same
        return self.known[about]

    def _said(self, data: dict[str, Any]) -> tuple[str, str]:
        try:
            reference = self._translated(decode(Reference, data["reference"]))
            with _in_time():
                found = self._proved(reference, data["claim"])
        except _LateError:
            return LATE, "the opponent takes too long"
        except (LookupError, ValueError, TypeError, ArithmeticError, AssertionError) as error:
            return UNREADABLE, f"the opponent refuses it: {type(error).__name__}"
        if isinstance(found, self.classes["certificates.Certificate"]):
            return PROVED, ""
        if isinstance(found, self.classes["certificates.Counterexample"]):
            return REFUTED, ""
        return NEITHER, found.reason.partition(",")[0]

    def _translated(self, value: Any) -> Any:
        """Return what today's classes hold in the classes of then, which have the same names and fields."""
        if isinstance(value, tuple):
            return tuple(map(self._translated, value))
        if not is_dataclass(value):
            return value
        then = self.classes[_named(type(value))]
        return then(**{field.name: self._translated(getattr(value, field.name)) for field in fields(then)})

    def _proved(self, reference: Any, claim: dict[str, Any]) -> Any:
        prove = self.prover
        match claim["kind"]:
            case "window":
                return prove.prove_on_window(reference, float(claim["start"]), float(claim["end"]))
            case "instants":
                return prove.prove_at_instants(reference)
            case "all_phases" if "period" in claim and not reference.pieces:
                return prove.prove_for_all_phases(reference, claim["period"])
            case "all_times" if not reference.pieces:
                return prove.prove_while_settling(reference)
            case "all_times" | "all_phases":
                return prove.prove(reference)
        raise ValueError(f"claim: there is no {claim['kind']!r}")


def _named(of: type) -> str:
    """Return a class's name with that of its room: where in the room it is has changed since then."""
    return f"{of.__module__.split('.')[1]}.{of.__name__}"


_PROOF = ("covers", "terms", "tail_start", "last_step")


@contextmanager
def _in_time() -> Iterator[None]:
    """Raise _LateError where what is inside takes longer than it may."""

    def late(*_: object) -> None:
        raise _LateError

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


if __name__ == "__main__":
    sys.exit(run("tests.attack.opponent", {"files": (10_000, judge_twice)}, sys.argv[1:]))
