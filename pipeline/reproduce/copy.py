"""A copy of the project without results."""

import shutil
import subprocess
from pathlib import Path

from trackably.errors import InputError

_RESULTS = "data/results"


def copy_without_results(project: Path, folder: Path) -> None:
    """Copy what git knows of a project, or would add to it, into an empty folder; what was there is deleted.

    Files are copied as they are in the working tree, with changes that are not committed. Raises InputError.
    """
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=project,
        capture_output=True,
        check=False,
    )
    if listed.returncode:
        raise InputError(f"{project}: git cannot list its files: {listed.stderr.decode().strip()}")
    shutil.rmtree(folder, ignore_errors=True)
    for name in dict.fromkeys(listed.stdout.decode().split("\0")):
        source = project / name
        if source.is_file() and not name.startswith(f"{_RESULTS}/"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, folder / name)
