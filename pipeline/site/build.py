"""Build the site with Sphinx from `docs/`, results and notebooks, and write the paper with numbers of the results."""

import gc
import io
import re
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util.docutils import docutils_namespace, patch_docutils

from pipeline import story
from pipeline.compare.claims import judge_claim, load_claims
from pipeline.compare.model import JudgedClaim, Verdict
from pipeline.compare.reports import shown
from pipeline.experiments import Experiment, load_experiments
from pipeline.storage.results import Results
from pipeline.theorem import THEORY
from trackably.errors import InputError
from trackably.files import from_json, read_bytes, read_json, to_json, write_atomically, write_text

_FOLDED = "hide-input"
_FIGURES = re.compile(rb"\.\./data/results/([\w-]+)/figures/")

Cell = dict[str, Any]


def folded(notebook: Path) -> bytes:
    """Return a notebook whose code cells are folded, with its figures where the site has them.

    A cell without output that begins with % is hidden.
    """
    content: Any = from_json(_FIGURES.sub(rb"\1/", read_bytes(notebook)))
    content["cells"] = [_folded(cell) for cell in content["cells"]]
    return to_json(content)


def _folded(cell: Cell) -> Cell:
    if cell["cell_type"] != "code":
        return cell
    tags = ["remove-cell"] if "".join(cell["source"]).startswith("%") and not cell["outputs"] else [_FOLDED]
    return {**cell, "metadata": {**cell["metadata"], "tags": tags}}


Page = dict[str, Any]
"""The data of an experiment for templates, which ask `pipeline.story` for sentences and tables about its results."""


def page_of(experiment: Experiment, results: Results, notebook: str = "") -> Page:
    """Return the page of an experiment. Raises InputError if a stage has not run."""
    metrics: Any = read_json(results.metrics)
    return {
        "experiment": experiment,
        "results": results,
        "summary": read_json(results.summary),
        "proved": [method for method in metrics if results.certificate(method).exists()],
        "figures": sorted(results.figures.glob("*.svg")),
        "files": [*results.proofs, *sorted(results.folder.glob("*.mcap")), *results.folder.glob("layout.json")],
        "notebook": notebook,
    }


_HERE = Path(__file__).parent
_FLOAT_DIGITS = 6
_TEMPLATE = "template.ipynb"
_OF_FILES = re.compile(r"\[([^\]]+)\]\((?!\w+:|#|figures/)[^)]*\)")
"""A Markdown link to a file of the repository that is no page of the site."""


def write_sources(project: Path, into: Path) -> list[Page]:
    """Write the sources of a project's site into a folder, and return the pages of its experiments.

    Sources are the pages of `docs/`, and those of the report, whose first page is `results`. Experiments without
    results are left out. Raises InputError if no experiment has results.
    """
    root = project / "data" / "results"
    pages = []
    for experiment in load_experiments(project / "params.yaml").values():
        results = Results(experiment.name, root)
        if results.summary.exists():
            notebook = project / "notebooks" / f"{experiment.name}.ipynb"
            shown = f"notebook-{experiment.name}" if notebook.exists() else ""
            pages.append(page_of(experiment, results, shown))
            _copy((*pages[-1]["figures"], *pages[-1]["files"]), into / experiment.name)
    if not pages:
        raise InputError(f"{root}: there are no results to report; run `dvc repro` first")
    notebooks = [project / "notebooks" / f"{page['experiment'].name}.ipynb" for page in pages if page["notebook"]]
    more = [*_write_notebooks(project, notebooks, into), *_write_benchmark(project / "benchmarks", into)]
    shutil.copytree(project / "docs", into, dirs_exist_ok=True)
    told: Page = {"pages": pages, "claims": _judged(project), "more": more}
    for name, template, about in (
        ("results", "results", told),
        ("gallery", "gallery", told),
        *((page["experiment"].name, "experiment", Page(page=page, theory=project / THEORY)) for page in pages),
    ):
        write_text(into / f"{name}.md", _rendered(_HERE / "templates" / f"{template}.md.j2", **about))
    return pages


def _judged(project: Path) -> list[JudgedClaim]:
    """Return the verdicts of all claims about a project's results."""
    return [judge_claim(claim, project, project) for claim in load_claims(project / "claims.yaml").claims]


def _rendered(template: Path, claims: Sequence[JudgedClaim] = (), **about: Any) -> str:
    """Return the text of a template that is given `claims`, the number that is `held`, and what else it names."""
    templates = Environment(
        loader=FileSystemLoader(template.parent), undefined=StrictUndefined, keep_trailing_newline=True
    )
    templates.filters |= {"cell": _cell, "found": _found, "plain": _plain}
    held = sum(claim.new.holds for claim in claims)
    return templates.get_template(template.name).render(claims=claims, held=held, story=story, **about)


def _write_notebooks(project: Path, notebooks: Sequence[Path], into: Path) -> list[str]:
    """Write notebooks as pages, and return the names of those about no experiment."""
    for path in notebooks:
        write_atomically(into / f"notebook-{path.name}", folded(path))
    others = sorted({*(project / "notebooks").glob("*.ipynb")} - {*notebooks} - {project / "notebooks" / _TEMPLATE})
    for path in others:
        write_atomically(into / path.name, folded(path))
    return [path.stem for path in others]


def _write_benchmark(benchmarks: Path, into: Path) -> list[str]:
    """Write the existing pages of the benchmarks, and return their names."""
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
    """Return Markdown in one line that shows a text unchanged."""
    return re.sub(r"([!-/:-@[-`{-~])", r"\\\1", " ".join(text.split()))


def _found(verdict: Verdict) -> str:
    if verdict.reason or verdict.found is None:
        return verdict.reason or "no value"
    return f"{verdict.found:.{_FLOAT_DIGITS}g}" if isinstance(verdict.found, float) else shown(verdict.found)


_SETTINGS = {
    "project": "Trackably",
    "extensions": [
        "myst_nb",
        "sphinx.ext.autodoc",
        "sphinx.ext.napoleon",
        "pipeline.site.extension",
    ],
    "html_theme": "furo",
    "html_title": "Trackably",
    "html_static_path": [str(_HERE / "static")],
    "html_css_files": ["report.css"],
    "html_js_files": ["filter.js"],
    "html_math_renderer": "mathml",
    "html_show_sphinx": False,
    "html_show_copyright": False,
    "html_copy_source": False,
    "html_show_sourcelink": False,
    "add_module_names": False,
    "autodoc_member_order": "bysource",
    "autodoc_preserve_defaults": True,
    "autodoc_typehints_format": "short",
    "autodoc_type_aliases": {"ArrayLike": "ArrayLike", "Array": "Array"},
    "python_maximum_signature_line_length": 80,
    "nb_execution_mode": "off",
    "nb_render_markdown_format": "myst",
    "myst_enable_extensions": ["dollarmath"],
    "myst_disable_syntax": ["html_block", "html_inline"],  # HTML in texts is shown as text, and not run
    "myst_heading_anchors": 3,
    "myst_links_external_new_tab": False,
    # Notebooks link to files of the project that are no pages.
    "suppress_warnings": [
        "myst.xref_missing",
        "misc.highlighting_failure",
        "toc.not_included",
        "myst.header",
        "config.cache",
    ],
}


def build(project: Path, output: Path) -> list[str]:
    """Build the site of a project into a folder, and return the warnings of Sphinx.

    Raises InputError if there are no results, or if a page cannot be built.
    """
    said, warned = io.StringIO(), io.StringIO()
    with TemporaryDirectory() as temporary:
        sources, doctrees = Path(temporary) / "sources", Path(temporary) / "doctrees"
        write_sources(project, sources)
        gc.disable()  # to search the millions of nodes of documents for garbage takes a third of the time
        try:
            with patch_docutils(), docutils_namespace():
                Sphinx(sources, None, output, doctrees, "html", _SETTINGS, said, warned, freshenv=True).build(True)
        except SphinxError as error:
            raise InputError(f"the report cannot be built: {error}") from error
        finally:
            gc.enable()
    (output / ".buildinfo").unlink(missing_ok=True)
    return warned.getvalue().splitlines()


def text_of(project: Path) -> str:
    """Return the paper in Markdown. Raises InputError if results are missing."""
    names = list(load_experiments(project / "params.yaml"))
    results = {name: Results(name, project / "data" / "results") for name in names}
    summaries: dict[str, Any] = {name: read_json(found.summary) for name, found in results.items()}
    study: Any = read_json(project / "benchmarks" / "rivals" / "study.json")
    drawn = [row for row in study[-1] if row["factor"] == "all"]
    return _rendered(
        project / "paper" / "paper.md.j2",
        _judged(project),
        summaries=summaries,
        certificates=sum(len(found.proofs) for found in results.values()),
        drawn=drawn,
        rivals=len({row["rival"] for row in drawn}),
    )
