"""What the viewer shows of an experiment: all logs as one, and the layout that is made for them."""

from collections.abc import Mapping
from pathlib import Path

from pipeline.experiments import Experiment
from pipeline.layouts.experiment import layout_of
from pipeline.scene.geometry import plane_of
from pipeline.storage.results import Results
from pipeline.storage.topics import logs_of, topics_of
from pipeline.viewer.install import files_of
from pipeline.viewer.merged import merged
from trackably.files import to_json

PAGE = Path(__file__).parent / "page"


def shown(experiment: Experiment, results: Results, viewer: Path) -> Mapping[str, Path | bytes]:
    """Return everything that the page asks for, by path: the viewer's files, the log, and the layout.

    Raises InputError where there are no logs, and LogError for a damaged one.
    """
    plane = plane_of(experiment.plant, experiment.plane)
    layout = layout_of(experiment.plant, topics_of(results), plane)
    return {
        **files_of(viewer),
        "": PAGE / "index.html",
        "start.js": PAGE / "start.js",
        "log.mcap": merged(logs_of(results)),
        "about.json": to_json({"name": experiment.name, "layout": layout}),
    }
