"""Write the checker as one file that runs on a bare Python: `python -m pipeline.bundle OUT`.

The file is a zip application of the checker and mpmath; `python -I -S OUT certificate.json` runs it. Equal sources give
equal bytes: names are sorted, and all times are those of 1980.
"""

import sys
import zipfile
from collections.abc import Iterator
from importlib import metadata, util
from pathlib import Path

_MAIN = """from trackably.checker.__main__ import run

run()
"""
_LEFT_OUT = {"tests", "__pycache__"}


def write_bundle(out: Path) -> None:
    """Write the zip application to `out`. Raises OSError if it cannot be written."""
    files = {"__main__.py": _MAIN.encode(), "trackably/__init__.py": b""}
    files |= {f"trackably/checker/{name}": data for name, data in _sources("trackably.checker")}
    files |= {f"mpmath/{name}": data for name, data in _sources("mpmath")}
    files["mpmath/LICENSE"] = _license("mpmath")
    out.parent.mkdir(parents=True, exist_ok=True)
    with out.open("wb") as file:
        file.write(b"#!/usr/bin/env python3\n")
        with zipfile.ZipFile(file, "w") as archive:
            for name, data in sorted(files.items()):
                entry = zipfile.ZipInfo(name)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.create_system = 3  # Unix, whatever system writes the file
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, data, compresslevel=9)


def _sources(package: str) -> Iterator[tuple[str, bytes]]:
    """Yield the names and contents of a package's modules."""
    found = util.find_spec(package)
    if found is None or found.origin is None:
        raise ModuleNotFoundError(package)
    folder = Path(found.origin).parent
    for path in sorted(folder.rglob("*.py")):
        name = path.relative_to(folder)
        if not _LEFT_OUT & set(name.parts):
            yield name.as_posix(), path.read_bytes()


def _license(distribution: str) -> bytes:
    """Return the content of the licence file of an installed distribution."""
    for path in metadata.files(distribution) or ():
        if path.name.startswith(("LICENSE", "LICENCE", "COPYING")):
            return path.read_binary()
    raise FileNotFoundError(f"the installed {distribution} comes without its licence; install it again from PyPI")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m pipeline.bundle OUT")
    try:
        write_bundle(Path(sys.argv[1]))
    except OSError as error:
        sys.exit(f"error: {sys.argv[1]}: cannot be written ({error.strerror or error})")
