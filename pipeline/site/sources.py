"""The sources of the site: Markdown from templates, notebooks, and copies of what they show and offer."""

import re
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from pipeline.compare.claims import judge_claim, load_claims
from pipeline.compare.model import JudgedClaim
from pipeline.compare.reports import shown
from pipeline.experiments import load_experiments
from pipeline.site.notebooks import errata, folded
from pipeline.site.pages import Page, page_of
from pipeline.storage.results import Results
from pipeline.storage.theorems import THEORY
from trackably.errors import InputError
from trackably.files import write_atomically, write_text

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
