"""Check that each certificate is about a reference that was learned: one for another reference proves nothing here."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from pipeline.compare.content.documents import json_leaves, read_json
from pipeline.compare.content.recordings import read_recording
from pipeline.compare.content.values import Leaf, Leaves, UnreadableError
from pipeline.compare.model import Row, Status

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
    return [place for place in places if _value(certified, place) != _value(learned, place)]


def _value(leaves: Leaves, place: str) -> object:
    return leaves[place].value if place in leaves else Leaf


def _shown(leaves: Leaves, place: str) -> str:
    return repr(leaves[place].value) if place in leaves else "not there"
