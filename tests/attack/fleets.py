"""Fleets whose names are drawn to be taken for each other, and whose files are mixed up: rows have to be true."""

import csv
import re
import shutil
import unicodedata
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.attack.counts import Counts
from tests.trackably.fleet.recordings import PLANT, motion
from tests.trackably.fleet.test_folder import PIECES, folder_of
from trackably import Fleet, SquaredExponential, learn_many, learn_reference
from trackably.checker import Proved
from trackably.errors import InputError
from trackably.files import read_json
from trackably.fleet.folder import printable

_GIVEN = {"noise_std": 0.01, "method": "hyperparameters"}
_KERNEL = SquaredExponential(signal_std=1.0, lengthscale=0.3)
_MOTIONS = 8
_FORMULA = re.compile("[=+@\t\r\n\uff0b\uff0d\uff1d\uff20-]")


def attack_fleet(counts: dict[str, Counts], seed: int, number: int) -> None:
    """Learn a fleet with names that are alike, again with other samples, mix up its files, and load every reference."""
    rng, family = np.random.default_rng((seed, number, 12)), counts.setdefault("names of fleets", Counts())
    names = _names(rng)
    with TemporaryDirectory() as folder:
        inside = Path(folder) / "in" / "fleet"
        for _ in range(2):
            motions = dict(zip(names, rng.permutation(_MOTIONS).tolist(), strict=False))
            given = {name: motion(seed) for name, seed in motions.items()}
            fleet = learn_many(given, PLANT, _KERNEL, "all_times", folder=inside, progress=False, **_GIVEN)
            _judge_rows(family, fleet, motions)
        outside = {path for path in Path(folder).rglob("*") if not path.is_relative_to(Path(folder) / "in")}
        if outside:
            family.false.append(f"{names!a}: {outside} are written")
        _judge_table(family, fleet, names)
        _mix_up(fleet, rng)
        for name in names:
            family.tried += 1
            if (found := _loaded(fleet, name)) is not None:
                family.accepted += 1
                family.judged(f"{name!a} of {names!a}, files mixed up", found == _fingerprint(motions[name]))


def _names(rng: np.random.Generator) -> list[str]:
    """Some names, each but the first mostly a change of another one."""
    names: dict[str, None] = {}
    while len(names) < int(rng.integers(2, _MOTIONS)):
        name = "".join(rng.choice(PIECES, int(rng.integers(1, 4))))
        if names and rng.random() < 0.7:
            name = _changed(str(rng.choice([*names])), name, rng)
        if name:
            names[name] = None
    return [*names]


def _changed(name: str, other: str, rng: np.random.Generator) -> str:
    at = int(rng.integers(len(name) + 1))
    changes = (
        name.swapcase(),
        folder_of(name),
        f"/{name}",
        f"{name}/",
        name.replace("/", "//"),
        f"{name}/{other}",
        f"../{name}",
        unicodedata.normalize("NFD", name),
        unicodedata.normalize("NFKC", name),
        name[:at] + other + name[at:],
        name * 100,
        name + chr(int(rng.integers(0x110000))),
    )
    return changes[int(rng.integers(len(changes)))]


def _judge_rows(family: Counts, fleet: Fleet, motions: dict[str, int]) -> None:
    """Each proved row has the reference of its own samples and an accepted certificate; the rest is too long."""
    for row in fleet.rows:
        family.tried += 1
        what = f"{row.name!a} of {[*motions]!a}"
        if row.outcome != "proved":
            if row.outcome != "unusable" or "too long" not in row.sentence:
                family.false.append(f"{what}: {row.sentence}")
            continue
        family.accepted += 1
        verdict = family.checked(read_json(fleet.folder / folder_of(row.name) / "certificate.json"))
        wanted = _fingerprint(motions[row.name])
        family.judged(what, row.fingerprint == wanted == _loaded(fleet, row.name) and isinstance(verdict, Proved))


def _judge_table(family: Counts, fleet: Fleet, names: list[str]) -> None:
    csv.field_size_limit(2**31 - 1)  # a name that is repeated a hundred times, three times over, is longer than usual
    with fleet.table.open(encoding="utf-8", newline="") as file:
        cells = [row[0] for row in csv.reader(file)][1:]
    told = [*map(printable, names)]
    is_text = not any(_FORMULA.match(cell) for cell in cells)
    if not is_text or [cell.removeprefix("'") for cell in cells] != told:
        family.false.append(f"{names!a}: the table has {cells!a}")


def _mix_up(fleet: Fleet, rng: np.random.Generator) -> None:
    """Put one file in the place of another one, or of a row."""
    files = sorted(path for path in fleet.folder.rglob("*.json") if path.is_file())
    if len(files) > 1:
        shutil.copyfile(*rng.choice(np.array(files, dtype=object), 2, replace=False))


def _loaded(fleet: Fleet, name: str) -> str | None:
    try:
        return fleet.reference(name).fingerprint
    except InputError:
        return None


@cache
def _fingerprint(seed: int) -> str:
    return learn_reference(motion(seed), PLANT, _KERNEL, "all_times", progress=False, **_GIVEN).fingerprint
