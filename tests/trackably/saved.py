"""What every saved reference has to be."""

from pathlib import Path

from trackably import StreamReference, TrackableReference


def assert_comes_back(found: TrackableReference | StreamReference, folder: Path) -> None:
    """What is saved is loaded, proved again by the same certificates, says the same, and is saved as the same bytes."""

    def written(of: TrackableReference | StreamReference) -> list[bytes]:
        of.save(path := folder / "saved.json")
        return [file.read_bytes() for file in (path, *of.save_certificate(folder / "proof.json"))]

    before = written(found)
    again = type(found).load(folder / "saved.json")
    assert (again.explanation, again.misfit) == (found.explanation, found.misfit)
    assert written(again) == before
