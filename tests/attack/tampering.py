"""Random changes of certificates and counterexamples, small and absurd."""

from typing import Any

import numpy as np

from tests.attack.bases import Base
from tests.attack.counts import Counts
from tests.trackably.checker.changes import changed, combined_changes, leaves, part_at, replacements, without


def attack_certificate(counts: dict[str, Counts], known: list[Base], seed: int, number: int) -> None:
    """Change one of the known files, by the random numbers of this number, and count whether it is accepted."""
    rng = np.random.default_rng((seed, number))
    base = known[int(rng.integers(len(known)))]
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
