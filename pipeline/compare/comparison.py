"""Compare two folders or revisions: artifacts, certificates with the fits they are about, claims, environments."""

import subprocess
import tarfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pipeline.compare.claims import Claims, judge_claim
from pipeline.compare.content import (
    Leaf,
    Leaves,
    Part,
    UnreadableError,
    csv_parts,
    json_leaves,
    json_parts,
    judge,
    read_csv,
    read_json,
    read_recording,
    recording_parts,
)
from pipeline.compare.figures import (
    drawing_parts,
    notebook_parts,
    picture_parts,
    read_drawing,
    read_notebook,
    read_picture,
)
from pipeline.compare.model import RESULTS, Comparison, Row, Status, Tolerances, Version, results_folder
from pipeline.environment import NAMES
from pipeline.storage.results import ENVIRONMENT, TIMINGS
from trackably.errors import InputError
from trackably.files import from_json

NOTEBOOKS = Path("notebooks")


@dataclass(frozen=True)
class Kind:
    """How files of a kind are read and divided into parts. A `divided` file has one row for each part."""

    read: Callable[[Path], Any]
    parts: Callable[[Any, Any], Iterable[Part]]
    divided: bool = False


def _bytes(read: Callable[[bytes], Any]) -> Callable[[Path], Any]:
    return lambda path: read(path.read_bytes())


def _hash_parts(base: bytes, new: bytes) -> list[Part]:
    base_leaf, new_leaf = ({"SHA-256": Leaf("bytes", sha256(data).hexdigest())} for data in (base, new))
    return [Part("", "", base_leaf, new_leaf)]


KINDS: Mapping[str, Kind] = {
    ".json": Kind(_bytes(read_json), json_parts),
    ".csv": Kind(_bytes(read_csv), csv_parts),
    ".mcap": Kind(read_recording, recording_parts, divided=True),
    ".svg": Kind(_bytes(read_drawing), drawing_parts),
    ".png": Kind(_bytes(read_picture), picture_parts),
    ".ipynb": Kind(_bytes(read_notebook), notebook_parts),
}
_ANY = Kind(_bytes(bytes), _hash_parts)


def artifacts(root: Path) -> dict[str, Path]:
    """Return the artifacts below a folder by name: `example1/metrics.json`, `notebooks/example1.ipynb`.

    The folder is that of a project, or of its results alone. Hidden files, wall clocks and records of the environment
    are no artifacts.
    """
    results = results_folder(root)
    named = {path.relative_to(results).as_posix(): path for path in _files(results)}
    if results != root:
        named |= {path.relative_to(root).as_posix(): path for path in _files(root / NOTEBOOKS)}
    return named


_NO_ARTIFACTS = {TIMINGS, ENVIRONMENT}
"""Durations on one machine are not compared, and the environment is compared by itself."""


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.is_file() and not hidden and path.name not in _NO_ARTIFACTS:
            yield path


def artifact_rows(name: str, base: Path | None, new: Path | None, tolerances: Tolerances) -> list[Row]:
    """Return the rows of one artifact, whose file may be missing on one side."""
    if base is None or new is None:
        return [Row(name, "", "", Status.EXTRA if base is None else Status.MISSING)]
    kind = KINDS.get(Path(name).suffix, _ANY)
    same = base.read_bytes() == new.read_bytes()
    if same and not kind.divided:
        return [Row(name, "", "", Status.IDENTICAL)]
    sides, complaints = [], []
    for labels, path in ((("BASE", "NEW"), base),) if same else ((("BASE",), base), (("NEW",), new)):
        try:
            sides += [kind.read(path)] * len(labels)
        except UnreadableError as error:
            complaints += [f"cannot be read in {label}: {error}" for label in labels]
    if not complaints:
        try:
            rows = [judge(name, part, tolerances) for part in kind.parts(*sides)]
        except UnreadableError as error:
            complaints.append(f"cannot be read: {error}")
    if complaints:
        return [Row(name, "", "", Status.DIFFERENT, notes=tuple(complaints))]
    if not same and all(row.status is Status.IDENTICAL for row in rows):
        note = "the same content in other bytes"
        if not kind.divided:
            return [Row(name, "", "", Status.WITHIN, compared=rows[0].compared, notes=(*rows[0].notes, note))]
        rows.append(Row(name, "", "", Status.WITHIN, notes=(note,)))
    return rows


_FIT = "fit.mcap"


def certificate_rows(artifacts: tuple[Mapping[str, Path], Mapping[str, Path]]) -> Iterator[Row]:
    """Yield a row for each certificate that belongs to no reference of its experiment's fit, in BASE or NEW."""
    fits = _Fits({})
    for name in {**artifacts[0], **artifacts[1]}:
        complaints = [
            f"in {label}, {complaint}"
            for label, side in zip(("BASE", "NEW"), artifacts, strict=True)
            if name in side and (complaint := _complaint(name, side, fits))
        ]
        if complaints:
            yield Row(name, "reference", "", Status.DIFFERENT, notes=tuple(complaints))


@dataclass(frozen=True)
class _Fits:
    """What logs of fits hold, by their bytes: several certificates are about one fit, and both sides may have it."""

    known: dict[bytes, dict[str, Leaves]]

    def learned(self, fit: Path) -> dict[str, Leaves]:
        """Return the values of each learned reference, by method. Raises UnreadableError."""
        digest = sha256(fit.read_bytes()).digest()
        if digest not in self.known:
            self.known[digest] = _learned(fit)
        return self.known[digest]


def _complaint(name: str, side: Mapping[str, Path], fits: _Fits) -> str | None:
    """Say what is wrong about the reference of a certificate; None where nothing is, or the file is no certificate."""
    certificate = _certificate(side[name])
    if certificate is None:
        return None
    if not isinstance(certificate.get("reference"), dict):
        return "the certificate names no reference: it is of an earlier version, or damaged"
    about = json_leaves(certificate["reference"])
    fit = f"{name.split('/', maxsplit=1)[0]}/{_FIT}"
    try:
        learned = fits.learned(side[fit]) if fit in side else {}
    except UnreadableError as error:
        return f"it cannot be told what the certificate is about: {fit} cannot be read: {error}"
    if not learned:
        return f"it cannot be told what the certificate is about: there are no references in {fit}"
    # A certificate named after a method has to be about what this method learned.
    method = Path(name).stem.removeprefix("certificate").lstrip("-_.")
    candidates = {method: learned[method]} if method in learned else learned
    apart = {method: _apart(about, leaves) for method, leaves in candidates.items()}
    nearest = min(apart, key=lambda method: len(apart[method]))
    if not apart[nearest]:
        return None
    place = apart[nearest][0]
    return (
        f"the certificate is for another reference: {place} is {_shown(about, place)} in it, "
        f"and {_shown(candidates[nearest], place)} in the reference {nearest!r} of {fit}"
    )


def _certificate(path: Path) -> dict[object, object] | None:
    """Return the content of a certificate; None where a file is none, or cannot be read, which its own row says."""
    if path.suffix != ".json":
        return None
    try:
        match read_json(path.read_bytes()):
            case {"format": "trackably certificate", **rest}:
                return rest
    except UnreadableError:
        pass
    return None


def _learned(fit: Path) -> dict[str, Leaves]:
    """Return the values of each learned reference, by method."""
    found = {}
    for name, data in read_recording(fit).attachments.items():
        match read_json(data):
            case {"reference": dict(reference)}:
                found[name.removesuffix(".json")] = json_leaves(reference)
    return found


def _apart(certified: Leaves, learned: Leaves) -> list[str]:
    """Return the places at which the two differ: a proof is about exactly these numbers, to the last bit."""
    places = {**certified, **learned}
    return [place for place in places if _value_at(certified, place) != _value_at(learned, place)]


def _value_at(leaves: Leaves, place: str) -> object:
    return leaves[place].value if place in leaves else Leaf


def _shown(leaves: Leaves, place: str) -> str:
    return repr(leaves[place].value) if place in leaves else "not there"


def versions(base: Path, new: Path) -> tuple[Version, ...]:
    """Return both environments as results record them."""
    sides = recorded(results_folder(base)), recorded(results_folder(new))
    return tuple(Version(name, sides[0].get(name), sides[1].get(name)) for name in NAMES)


def recorded(results: Path) -> dict[str, str]:
    """Return what the experiments of a results folder record; several values of a name are joined by " or ".

    Raises InputError where a record is not an object of names and versions.
    """
    records = [_record(path) for path in sorted(results.glob(f"*/{ENVIRONMENT}"))]
    names = dict.fromkeys(name for record in records for name in record)
    return {name: " or ".join(_distinct(record.get(name) for record in records)) for name in names}


def _distinct(values: Iterable[str | None]) -> list[str]:
    return sorted({value for value in values if value is not None})


def _record(path: Path) -> dict[str, str]:
    try:
        content = from_json(path.read_bytes())
    except ValueError as error:
        raise InputError(f"{path}: is no JSON: {error}") from error
    match content:
        case dict() if all(isinstance(text, str) for text in content.values()):
            return content
    raise InputError(f"{path}: expected an object of names and versions")


_WANTED = (RESULTS.as_posix(), NOTEBOOKS.as_posix())


@contextmanager
def laid_out(name: str, repository: Path = Path()) -> Iterator[Path]:
    """Yield a folder with the artifacts of `name`: that folder itself, or those of that revision of `repository`.

    Raises InputError where `name` is neither.
    """
    if Path(name).is_dir():
        yield Path(name)
        return
    commit = _commit(name, repository)
    with TemporaryDirectory() as folder:
        _extract(commit, repository, Path(folder))
        if not (Path(folder) / RESULTS).is_dir():
            raise InputError(f"{name}: this revision has no results in {RESULTS}")
        yield Path(folder)


def _commit(name: str, repository: Path) -> str:
    done = _git(repository, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{name}^{{commit}}")
    if done.returncode:
        raise InputError(f"{name}: is neither a folder nor a revision of this repository")
    return done.stdout.decode().strip()


def _extract(commit: str, repository: Path, folder: Path) -> None:
    top = _git(repository, "rev-parse", "--show-toplevel").stdout.decode().strip()
    there = _git(Path(top), "ls-tree", "--name-only", commit, "--", *_WANTED).stdout.decode().splitlines()
    done = _git(Path(top), "archive", "--format=tar", commit, "--", *there)
    if done.returncode:
        raise InputError(f"{commit}: cannot be read by git: {done.stderr.decode().strip()}")
    with tarfile.open(fileobj=BytesIO(done.stdout)) as archive:
        for member in archive:
            file = archive.extractfile(member) if member.isfile() else None
            if file:
                path = folder / member.name
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(file.read())


def _git(folder: Path, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    try:
        return subprocess.run(["git", *arguments], cwd=folder, capture_output=True, check=False)
    except FileNotFoundError as error:
        raise InputError("git is not installed, and only folders can be compared without it") from error


def compare(
    base: Path,
    new: Path,
    tolerances: Tolerances,
    claims: Claims,
    base_name: str | None = None,
    new_name: str | None = None,
) -> Comparison:
    """Return what moved from the folder `base` to the folder `new`, each of a project or of its results alone.

    Notebooks are compared if both sides have them. `base_name` and `new_name` are what a report shows. Raises
    InputError where a folder holds no results, or a claim refers to a printed number that does not exist.
    """
    sides = artifacts(base), artifacts(new)
    for root, name, found in zip((base, new), (base_name, new_name), sides, strict=True):
        if not found:
            raise InputError(f"{name or root}: holds no results to compare")
    notes: tuple[str, ...] = ()
    if not ((base / NOTEBOOKS).is_dir() and (new / NOTEBOOKS).is_dir()):
        notes = ("notebooks are not compared: one side has none",)
        sides = _without_notebooks(sides[0]), _without_notebooks(sides[1])
    rows = [
        row
        for name in sorted({*sides[0], *sides[1]})
        for row in artifact_rows(name, sides[0].get(name), sides[1].get(name), tolerances)
    ]
    return Comparison(
        base_name or str(base),
        new_name or str(new),
        (*rows, *certificate_rows(sides)),
        tuple(judge_claim(claim, base, new) for claim in claims.claims),
        versions(base, new),
        notes,
    )


def _without_notebooks(found: dict[str, Path]) -> dict[str, Path]:
    return {name: path for name, path in found.items() if not name.startswith(f"{NOTEBOOKS.as_posix()}/")}
