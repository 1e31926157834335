"""Compare two folders or revisions: artifacts, claims, environments."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZipFile

from pipeline.compare.artifacts import (
    ABSENT,
    Leaves,
    Parts,
    UnreadableError,
    parts_of,
    same,
)
from pipeline.compare.claims import Claims, judge_claim
from pipeline.compare.model import RESULTS, Comparison, Difference, Row, Status, Tolerances, results_folder
from pipeline.environment import NAMES
from pipeline.storage.results import ENVIRONMENT
from trackably.errors import InputError
from trackably.files import read_json

NOTEBOOKS = Path("notebooks")


def artifacts(root: Path, with_notebooks: bool = True) -> dict[str, Path]:
    """Return the artifacts below a folder by name: `example1/metrics.json`, `notebooks/example1.ipynb`.

    The folder is that of a project, or of its results alone. Hidden files are left out, and so are records of the
    environment, which `recorded` reads.
    """
    results = results_folder(root)
    named = {path.relative_to(results).as_posix(): path for path in _files(results)}
    if results != root and with_notebooks:
        named |= {path.relative_to(root).as_posix(): path for path in _files(root / NOTEBOOKS)}
    return named


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.is_file() and not hidden and path.name != ENVIRONMENT:
            yield path


def artifact_rows(name: str, base: Path | None, new: Path | None, tolerances: Tolerances) -> list[Row]:
    """Compare the files of one artifact, and return a row; for logs that differ, a row for each of their parts.

    A file that is missing on one side is None.
    """
    if base is None or new is None:
        return [Row(name, "", "", Status.EXTRA if base is None else Status.MISSING)]
    if base.read_bytes() == new.read_bytes():
        return [Row(name, "", "", Status.IDENTICAL)]
    sides: list[Parts] = []
    complaints = []
    for label, path in (("BASE", base), ("NEW", new)):
        try:
            sides.append(parts_of(path))
        except UnreadableError as error:
            complaints.append(f"cannot be read in {label}: {error}")
    if complaints:
        return [Row(name, "", "", Status.DIFFERENT, notes=tuple(complaints))]
    rows = [_judge(name, part, sides[0].get(part), sides[1].get(part), tolerances) for part in {**sides[0], **sides[1]}]
    if all(row.status is Status.IDENTICAL for row in rows):
        return [Row(name, "", "", Status.WITHIN, notes=("the same content in other bytes",))]
    return rows


def _judge(
    artifact: str, part: tuple[str, str], base: Leaves | None, new: Leaves | None, tolerances: Tolerances
) -> Row:
    """Compare one part of an artifact within the tolerances, and return its row; a missing part is None."""
    if base is None or new is None:
        return Row(artifact, *part, Status.EXTRA if base is None else Status.MISSING)
    found, left_out = [], set()
    rule_of = tolerances.rules_for(artifact, part[0])
    places = {**base, **new}
    for place in places:
        one, other = (side[place].value if place in side else ABSENT for side in (base, new))
        if same(one, other):
            continue
        if (rule := rule_of((base.get(place) or new[place]).field)).ignore:
            left_out.add(rule.name)
        else:
            found.append(Difference(place, one, other, rule))
    excess = [difference.excess for difference in found]  # computed once each, as there may be a million differences
    beyond = sum(of > 1 for of in excess)
    return Row(
        artifact,
        *part,
        Status.DIFFERENT if beyond else Status.WITHIN if found or left_out else Status.IDENTICAL,
        found[excess.index(max(excess))] if found else None,
        compared=len(places),
        differing=len(found),
        beyond=beyond,
        notes=tuple(f"not compared, by rule {name!r}: some values that differ" for name in sorted(left_out)),
    )


def recorded(results: Path) -> dict[str, str]:
    """Return the environment that the experiments of a results folder record; different values are joined by " or ".

    Raises InputError if a record is not an object of names and versions.
    """
    found: dict[str, set[str]] = {}
    for path in sorted(results.glob(f"*/{ENVIRONMENT}")):
        content = read_json(path)
        if not isinstance(content, dict) or not all(isinstance(text, str) for text in content.values()):
            raise InputError(f"{path}: expected a JSON object of names and versions")
        for name, value in content.items():
            found.setdefault(name, set()).add(value)
    return {name: " or ".join(sorted(values)) for name, values in found.items()}


@contextmanager
def laid_out(name: str) -> Iterator[Path]:
    """Yield a folder with the artifacts of `name`: that folder itself, or those of that revision of this repository.

    Raises InputError if `name` is neither.
    """
    if Path(name).is_dir():
        yield Path(name)
        return
    found = _git("rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
    if found.returncode:
        raise InputError(f"{name}: is neither a folder nor a revision of this git repository")
    done = _git("archive", "--format=zip", found.stdout.decode().strip())
    if done.returncode:
        raise InputError(f"{name}: cannot be read by git: {done.stderr.decode().strip()}")
    with TemporaryDirectory() as folder, ZipFile(BytesIO(done.stdout)) as archive:
        archive.extractall(folder)
        if not (Path(folder) / RESULTS).is_dir():
            raise InputError(f"{name}: this revision has no results in {RESULTS}")
        yield Path(folder)


def _git(*arguments: str) -> "subprocess.CompletedProcess[bytes]":
    try:
        return subprocess.run(["git", *arguments], capture_output=True, check=False)
    except FileNotFoundError as error:
        raise InputError("git is not installed; without git, give folders in place of revisions") from error


def compare(base: Path, new: Path, tolerances: Tolerances, claims: Claims, base_name: str, new_name: str) -> Comparison:
    """Compare the folder `new` with the folder `base`, each of a project or of its results alone.

    Notebooks are compared if both sides have them. `base_name` and `new_name` are what a report shows. Raises
    InputError if a folder holds no results, or a claim refers to a printed number that does not exist.
    """
    with_notebooks = all((root / NOTEBOOKS).is_dir() for root in (base, new))
    sides = [artifacts(root, with_notebooks) for root in (base, new)]
    for name, found in zip((base_name, new_name), sides, strict=True):
        if not found:
            raise InputError(f"{name}: holds no results to compare")
    rows = [
        row
        for name in sorted({*sides[0], *sides[1]})
        for row in artifact_rows(name, sides[0].get(name), sides[1].get(name), tolerances)
    ]
    versions = [recorded(results_folder(root)) for root in (base, new)]
    return Comparison(
        base_name,
        new_name,
        tuple(rows),
        tuple(judge_claim(claim, base, new) for claim in claims.claims),
        {name: (versions[0].get(name), versions[1].get(name)) for name in NAMES},
        () if with_notebooks else ("notebooks are not compared: one side has none",),
    )
