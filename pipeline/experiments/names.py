"""Names of experiments: each becomes a folder, a notebook, a DVC stage and a command-line argument."""

import re
from collections.abc import Iterable

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
_RESERVED = {
    "guide": "notebooks/guide.ipynb is the guide",
    "recordings": "data/recordings holds the recordings",
    "trajectories": "notebooks/trajectories.ipynb is about trajectories from elsewhere",
    "template": "notebooks/template.ipynb is the template",
}


def refused_names(names: Iterable[object]) -> list[str]:
    """Return one sentence for each name that cannot be an experiment's; an empty list where all can."""
    names = list(names)
    return [*(reason for name in names if (reason := _refusal(name))), *_same_but_for_case(names)]


def _refusal(name: object) -> str | None:
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        return (
            f"the name {name!r} is not allowed: a name consists of letters from a to z, digits, hyphens and "
            "underscores, and begins with a letter or a digit (quote a name that is a number)"
        )
    if reason := _RESERVED.get(name.lower()):
        return f"the name {name!r} is reserved: {reason}"
    return None


def _same_but_for_case(names: list[object]) -> list[str]:
    """Return a sentence for each pair that differs only by case: some file systems hold only one of the two."""
    first: dict[str, str] = {}
    found = []
    for name in names:
        if isinstance(name, str) and (other := first.setdefault(name.lower(), name)) != name:
            found.append(f"the names {other!r} and {name!r} differ only by case: choose names that differ otherwise")
    return found
