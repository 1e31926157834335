"""The stage that draws figures."""

from matplotlib.figure import Figure

from pipeline import figures
from pipeline.experiments import load_experiment
from pipeline.storage.results import Results


def test_figures_of_an_earlier_run_do_not_stay(tmp_path, monkeypatch):
    """Where nothing is lost any more, say, there is no figure of how it was lost."""
    results = Results("example1", tmp_path)
    results.figures.mkdir(parents=True)
    results.figure("old").write_text("<svg/>")
    (results.figures / "notes.txt").write_text("mine")
    monkeypatch.setattr(figures, "drawings", lambda *_: {"new": lambda: Figure(figsize=(1, 1))})
    monkeypatch.setattr(figures, "write_scene", lambda *_: None)
    figures.figures(load_experiment("example1"), results)
    assert sorted(path.name for path in results.figures.iterdir()) == ["new.svg", "notes.txt"]
