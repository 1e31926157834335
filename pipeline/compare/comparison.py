"""Compare two folders: artifacts, certificates, claims, environments."""

from pathlib import Path

from pipeline.compare.artifacts import NOTEBOOKS, artifact_rows, artifacts, results_folder
from pipeline.compare.certificates import certificate_rows
from pipeline.compare.claims import Claims
from pipeline.compare.model import Comparison
from pipeline.compare.tolerances import Tolerances
from pipeline.compare.verdicts import judge_claim
from pipeline.compare.versions import versions
from trackably.errors import InputError


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
        versions(base, new, (results_folder(base), results_folder(new))),
        notes,
    )


def _without_notebooks(found: dict[str, Path]) -> dict[str, Path]:
    return {name: path for name, path in found.items() if not name.startswith(f"{NOTEBOOKS.as_posix()}/")}
