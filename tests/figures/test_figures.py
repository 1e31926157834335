"""Every committed figure: no text touches another one, and none leaves the canvas."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from pipeline.drawings.style import svg
from tests.figures.texts import collisions
from tests.project import ROOT
from trackably.exports.figures import with_style

FIGURES = sorted(
    path
    for folder in ("data/results", "benchmarks")
    for path in (ROOT / folder).rglob("*.svg")
    if path.parent.name == "figures"
)
_GAP = 1.0
"""Texts that are nearer to each other [pt] look like one."""


@pytest.mark.parametrize("path", FIGURES, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_text_is_hidden(path: Path) -> None:
    assert collisions(path.read_bytes(), _GAP) == []


@with_style
def labelled(*labels: tuple[float, float, str]) -> Figure:
    """Draw labels at places of a panel from 0 to 1."""
    figure = Figure(figsize=(3, 2))
    axes = figure.subplots()
    axes.set(xlim=(0, 1), ylim=(0, 1), xlabel="time $t$ [s]")
    for x, y, text in labels:
        axes.text(x, y, text, in_layout=False)
    return figure


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        ([(0.2, 0.5, r"$\bar{k}$ = 7"), (0.6, 0.5, "held out"), (0.2, 0.8, "two\nlines")], []),
        ([(0.2, 0.5, "joint"), (0.25, 0.52, "robust")], ["'joint' touches 'robust'"]),
        ([(0.9, 0.5, "a word that is long")], ["'a word that is long' leaves the canvas"]),
    ],
    ids=["apart", "overlap", "outside"],
)
def test_planted_faults_are_named(labels: list[tuple[float, float, str]], said: list[str]) -> None:
    assert collisions(svg(labelled(*labels)), _GAP) == said
