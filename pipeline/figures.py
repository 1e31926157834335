"""Stage 5: all results → figures, and what viewers of the logs show beside curves."""

from tqdm import tqdm

from pipeline.drawings import drawings, style
from pipeline.experiments import Experiment
from pipeline.storage.results import Results
from pipeline.viewer.layout import write_scene


def figures(experiment: Experiment, results: Results) -> None:
    """Draw and save every figure of the experiment, and remove those of an earlier run that it no longer has.

    Scene, events and layout are written too, for viewers of the logs.
    """
    drawn = drawings(experiment, results)
    for name, draw in tqdm(drawn.items(), desc=f"{experiment.name}: figures", disable=None):
        style.save(draw(), results.figure(name))
    for old in {*results.figures.glob("*.svg")} - {results.figure(name) for name in drawn}:
        old.unlink()
    write_scene(experiment, results)
