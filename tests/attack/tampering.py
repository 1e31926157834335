"""Random changes of certificates and counterexamples, small and absurd."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tests.attack.bases import Base
from tests.attack.counts import Counts
from tests.attack.huge import HUGE, MOST_MEMORY, MOST_SECONDS, READ, RECORDINGS, answers, measured, write
from tests.trackably.checker.changes import PLANT, changed, combined_changes, leaves, part_at, replacements, without
from tests.trackably.checker.edges import hostile
from tests.trackably.checker.edges.test_names import renamed
from tests.trackably.systems.test_naming import NAMES, NO_NAMES
from trackably.checker import Proved, limits


def attack_certificate(counts: dict[str, Counts], known: list[Base], seed: int, number: int) -> None:
    """Change one of the known files, by the random numbers of this number, and count whether it is accepted."""
    rng = np.random.default_rng((seed, number))
    if number % 10 == 8:
        _attack_names(counts, rng)
    elif number % 500 == 29:
        _attack_machine(counts, number // 500)
    elif number % 50 == 9:
        _attack_limits(counts, known[0], rng)
    else:
        _attack_base(counts, known[int(rng.integers(len(known)))], rng)


def _attack_base(counts: dict[str, Counts], base: Base, rng: np.random.Generator) -> None:
    what, data = base.family, base.data
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        done, data = random_change(data, rng)
        what = f"{what}; {done}"
    family = counts.setdefault(base.family, Counts())
    family.attacked(what, data, lambda: base.is_true(data))


def random_change(data: dict, rng: np.random.Generator) -> tuple[str, dict]:
    """Return one change: of a part, of several that belong together, or a part left out."""
    paths = [path for path in leaves(data) if path[0] not in ("format", "version")]
    weights = np.array([0.2 if "covers" in path[:-1] else 1.0 for path in paths])
    path = paths[int(rng.choice(len(paths), p=weights / weights.sum()))]
    kind = int(rng.integers(12))
    if kind == 0:
        return f"without {path}", without(data, path)
    if kind == 1 and "trajectories" in data and "evaluation" in data and "attainable" not in data:
        try:
            every = list(combined_changes(data))
        except (LookupError, TypeError, ValueError, AttributeError, ZeroDivisionError, StopIteration):
            every = []  # an earlier change left nothing that could be changed so
        if every:
            return every[int(rng.integers(len(every)))]
    value = part_at(data, path)
    news = [*_numbers(value, rng), *_others(value)]
    new = news[int(rng.integers(len(news)))]
    return f"{path} = {new!r}", changed(data, path, new)


def _numbers(value: Any, rng: np.random.Generator) -> list[Any]:
    """Changes of a number by any size."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return []
    factor = 1 + float(rng.choice([-1, 1]) * 10 ** rng.uniform(-16, 1))
    return [value * factor, value + float(rng.choice([-1, 1]) * 10 ** rng.uniform(-17, 1))] * 5


def _others(value: Any) -> list[Any]:
    """Those of the tests; an empty list, or one of texts, has fewer."""
    try:
        return replacements(value)
    except (IndexError, TypeError, ValueError, OverflowError, ZeroDivisionError):
        return [None, [], 1.0]


def _attack_names(counts: dict[str, Counts], rng: np.random.Generator) -> None:
    """Another name for the state; what is printed has to be a line that can be printed."""
    family, is_name = counts.setdefault("hostile names", Counts()), rng.random() < 0.2
    pool = NAMES if is_name else NO_NAMES
    name = pool[int(rng.integers(len(pool)))]
    if not is_name and name != "(m)" and rng.random() < 0.7:  # any characters before what is none: a letter, by chance
        name = "".join(chr(int(c)) for c in rng.integers(1, 0xD900, int(rng.integers(1, 4)))) + name
        is_name = name.replace("-", "_").isidentifier()
    family.tried += 1
    verdict = family.checked(renamed(name))
    said = verdict.statement if isinstance(verdict, Proved) else verdict.reason
    if isinstance(verdict, Proved):
        family.accepted += 1
        family.judged(ascii(name), is_name and said.isprintable() and f'≤ "{name}" ≤' in said)
    elif not said.isprintable():
        family.false.append(f"printed: {said!a}")


def _attack_machine(counts: dict[str, Counts], number: int) -> None:
    """One of the files that would take hours or gigabytes: none may be accepted, or exceed its time or memory."""
    with TemporaryDirectory() as folder:
        for name, table in (("hours and gigabytes", HUGE), ("packed recordings", RECORDINGS)):
            family, (what, of) = counts.setdefault(name, Counts()), list(table.items())[number % len(table)]
            if isinstance(of, tuple):
                of.write(path := Path(folder) / of.name)
                took, codes, says = measured(path, command=("-c", READ)), (1,), of.says
            else:
                path = write(of(), Path(folder) / "file.json")
                took, codes, says = measured(path, "--seconds", "2"), answers(what), ""
            family.tried += 1
            family.undecided += took.code == 3
            family.longest = max(family.longest, took.seconds)
            is_cheap = took.seconds <= MOST_SECONDS and took.memory <= MOST_MEMORY
            if not (is_cheap and took.code in codes and says in took.said):
                family.false.append(f"{name}, {what}: {took}")


def _attack_limits(counts: dict[str, Counts], base: Base, rng: np.random.Generator) -> None:
    """Huge, deep and slow files; none of them is true."""
    family, n = counts.setdefault("huge files", Counts()), int(10 ** rng.uniform(1, 6))
    files = [
        lambda: hostile.tower(n % 80),
        lambda: hostile.deep(n % 900 + 1),
        lambda: hostile.long(n % 3000 + 1),
        lambda: hostile.chain(n % 100 + 2),
        lambda: hostile.instants(10**6 + n),
        lambda: changed(base.data, ("claim", "terms"), limits.TERMS + n),
        lambda: changed(base.data, ("claim", "covers", "state", "ends"), [0.0] * n),
        lambda: changed(base.data, ("reference", "signals", 0, "weights"), [1.0] * n),
        lambda: changed(base.data, (*PLANT, "state_set", "rows"), [[1.0]] * n),
        lambda: changed(base.data, ("trajectories", "states", 0, "offset"), "1" + "0" * n),
    ]
    chosen = int(rng.integers(len(files)))
    family.attacked(f"huge file {chosen} of size {n}", files[chosen](), lambda: False)
