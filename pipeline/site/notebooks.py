"""Notebooks as pages: as they were executed, with their code folded, and their notes on the paper put together."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from trackably.files import read_json, to_json

_ERRATA = "## Where the paper must be read with care"
_OPENING = "Misprints and gaps, each with its evidence. The notebooks of the examples define the symbols."
_FOLDED = "hide-input"
_SECTION = re.compile(r"^(?=##? )", re.MULTILINE)

Cell = dict[str, Any]


def folded(notebook: Path) -> bytes:
    """Return a notebook whose code is folded away, and whose setting-up cell is not shown."""
    content: Any = read_json(notebook)
    content["cells"] = [_folded(cell) for cell in content["cells"]]
    return to_json(content)


def errata(notebooks: Sequence[Path]) -> bytes:
    """Return one notebook with what all of these say about the paper, with the evidence."""
    opened: Mapping[str, Any] = {path.stem: read_json(path) for path in notebooks}
    cells = [_markdown(f"{_ERRATA.removeprefix('#')}\n\n{_OPENING}")]
    for content in opened.values():
        if found := list(_about_the_paper(content["cells"])):
            cells += [_markdown(f"## {_title(content['cells'])}"), *map(_folded, found)]
    first = next(iter(opened.values()), {"metadata": {}, "nbformat": 4, "nbformat_minor": 5})
    cells = [{**cell, "id": f"cell-{i}"} for i, cell in enumerate(cells)]
    return to_json({**first, "cells": cells})


def _about_the_paper(cells: Sequence[Cell]) -> Iterator[Cell]:
    """Yield what follows the heading, up to the next one of its level; a cell may hold both."""
    inside = False
    for cell in cells:
        if cell["cell_type"] == "code":
            if inside:
                yield cell
            continue
        for section in _SECTION.split("".join(cell["source"])):
            if _SECTION.match(section):
                inside = section.startswith(_ERRATA)
            if inside and (text := section.removeprefix(_ERRATA).strip()):
                yield _markdown(text)


def _title(cells: Sequence[Cell]) -> str:
    return "".join(cells[0]["source"]).splitlines()[0].removeprefix("# ")


def _folded(cell: Cell) -> Cell:
    if cell["cell_type"] != "code":
        return cell
    tags = ["remove-cell"] if "".join(cell["source"]).startswith("%") and not cell["outputs"] else [_FOLDED]
    return {**cell, "metadata": {**cell["metadata"], "tags": tags}}


def _markdown(text: str) -> Cell:
    return {"cell_type": "markdown", "metadata": {}, "source": text}
