"""What the page of an experiment says, from its results alone."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.experiments import Experiment
from pipeline.storage.loops import table_of_loops
from pipeline.storage.results import Results
from pipeline.storage.story import told_of_loops, told_of_price, told_of_proofs, told_of_system, told_of_theorems
from pipeline.storage.tables import table_of_methods
from trackably.files import read_json

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
