"""The sources of the site: Markdown from templates, notebooks, and copies of what they show and offer."""

import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pipeline.compare.claims import judge_claim, load_claims
from pipeline.compare.model import JudgedClaim
from pipeline.compare.reports import shown
from pipeline.experiments import Experiment, load_experiments
from pipeline.storage.loops import table_of_loops
from pipeline.storage.results import Results
from pipeline.storage.story import told_of_loops, told_of_price, told_of_proofs, told_of_system, told_of_theorems
from pipeline.storage.tables import table_of_methods
from pipeline.storage.theorems import THEORY
from trackably.errors import InputError
from trackably.files import read_json, to_json, write_atomically, write_text

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


_LOGS = {
    "samples": "the samples",
    "fit": "references, and the iterations on the way to them",
    "verification": "margins to all bounds",
    "control": "closed loops and feasible sets",
    "scene": "the scene, with what is proved and where no plan was found",
}


@dataclass(frozen=True)
class Page:
    """The page of an experiment: sentences and tables as Markdown, figures, and files with what they are."""

    name: str
    title: str
    system: str
    proofs: str
    theorems: str
    price: str
    methods: str
    loops: str
    table_of_loops: str
    summary: Mapping[str, float]
    proved: tuple[str, ...]
    figures: tuple[Path, ...]
    files: tuple[tuple[Path, str], ...]
    notebook: str = ""


def page_of(experiment: Experiment, results: Results, theory: Path, notebook: str = "") -> Page:
    """Return the page of an experiment; what Coq has proved is on record in the folder `theory`.

    Raises InputError where a stage has not run.
    """
    metrics: Any = read_json(results.metrics)
    summary: Any = read_json(results.summary)
    return Page(
        experiment.name,
        experiment.title,
        told_of_system(experiment.plant),
        told_of_proofs(results),
        told_of_theorems(results, theory),
        told_of_price(results),
        str(table_of_methods(results)),
        told_of_loops(results),
        str(table_of_loops(results)),
        summary,
        tuple(method for method, found in metrics.items() if results.certificate(method).exists()),
        tuple(sorted(results.figures.glob("*.svg"))),
        tuple(_files(results)),
        notebook,
    )


def _files(results: Results) -> Iterator[tuple[Path, str]]:
    for path in sorted(results.certificate("any").parent.glob("*.json")):
        refutes = path.name.endswith(".counterexample.json")
        method = path.name.split(".")[0]
        yield path, f"what refutes the reference `{method}`" if refutes else f"the certificate of `{method}`"
    for path in sorted(results.folder.glob("*.mcap")):
        yield path, f"log: {_LOGS.get(path.stem, path.stem)}"
    for path in sorted(results.folder.glob("layout.json")):
        yield path, "the layout for viewers of these logs"


_HERE = Path(__file__).parent
_FLOAT_DIGITS = 6
_TEMPLATE = "template.ipynb"
_OF_FILES = re.compile(r"\[([^\]]+)\]\((?!\w+:|#|figures/)[^)]*\)")
"""A link to a file of the repository, which is no page of the site."""


def write_sources(project: Path, into: Path) -> list[Page]:
    """Write the sources of a project's site into a folder, and return the pages of its experiments.

    These are the pages of its `docs/`, and those of the report, which begins with `results`.

    Experiments without results are left out. Raises InputError where none has any.
    """
    root = project / "data" / "results"
    pages = []
    for experiment in load_experiments(project / "params.yaml").values():
        results = Results(experiment.name, root)
        if results.summary.exists():
            notebook = project / "notebooks" / f"{experiment.name}.ipynb"
            shown = f"notebook-{experiment.name}" if notebook.exists() else ""
            pages.append(page_of(experiment, results, project / THEORY, shown))
            _copy((*pages[-1].figures, *(file for file, _ in pages[-1].files)), into / experiment.name)
    if not pages:
        raise InputError(f"{root}: there are no results to report; run `dvc repro` first")
    notebooks = [project / "notebooks" / f"{page.name}.ipynb" for page in pages if page.notebook]
    more = [*_write_notebooks(project, notebooks, into), *_write_benchmark(project / "benchmarks", into)]
    claimed = load_claims(project / "claims.yaml")
    claims = [judge_claim(claim, project, project) for claim in claimed.claims]
    shutil.copytree(project / "docs", into, dirs_exist_ok=True)
    _render(pages, claims, more, into)
    return pages


def _render(pages: Sequence[Page], claims: Sequence[JudgedClaim], more: Sequence[str], into: Path) -> None:
    templates = Environment(
        loader=FileSystemLoader(_HERE / "templates"), undefined=StrictUndefined, keep_trailing_newline=True
    )
    templates.filters |= {"cell": _cell, "found": _found, "plain": _plain}
    held = sum(claim.new.holds for claim in claims)
    text = templates.get_template("results.md.j2").render(pages=pages, claims=claims, held=held, more=more)
    write_text(into / "results.md", text)
    write_text(into / "gallery.md", templates.get_template("gallery.md.j2").render(pages=pages))
    for page in pages:
        write_text(into / f"{page.name}.md", templates.get_template("experiment.md.j2").render(page=page))


def _write_notebooks(project: Path, notebooks: Sequence[Path], into: Path) -> list[str]:
    """Write the experiments' notebooks, those that are about no experiment, and the errata; name the last two kinds."""
    for path in notebooks:
        write_atomically(into / f"notebook-{path.name}", folded(path))
    others = sorted({*(project / "notebooks").glob("*.ipynb")} - {*notebooks} - {project / "notebooks" / _TEMPLATE})
    for path in others:
        write_atomically(into / path.name, folded(path))
    write_atomically(into / "errata.ipynb", errata(notebooks))
    return [*(path.stem for path in others), "errata"]


def _write_benchmark(benchmarks: Path, into: Path) -> list[str]:
    """Write the pages that benchmarks left, as far as they are there, and name them."""
    written = []
    for folder, page in ((benchmarks, "benchmark"), (benchmarks / "rivals", "rivals/page")):
        if (table := folder / "README.md").exists():
            write_text(into / f"{page}.md", _OF_FILES.sub(r"\1", table.read_text(encoding="utf-8")))
            _copy((folder / "figures").glob("*.svg"), (into / page).parent / "figures")
            written.append(page)
    return written


def _copy(files: Iterable[Path], into: Path) -> None:
    into.mkdir(parents=True, exist_ok=True)
    for file in files:
        shutil.copyfile(file, into / file.name)


def _cell(text: object) -> str:
    return " ".join(str(text).split()).replace("|", r"\|")


def _plain(text: str) -> str:
    """Return Markdown of one line that shows the text as it is."""
    return re.sub(r"([!-/:-@[-`{-~])", r"\\\1", " ".join(text.split()))


def _found(verdict: object) -> str:
    found = getattr(verdict, "found", None)
    reason = getattr(verdict, "reason", "")
    if reason or found is None:
        return reason or "no value"
    return f"{found:.{_FLOAT_DIGITS}g}" if isinstance(found, float) else shown(found)
