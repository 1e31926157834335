"""A small project's artifacts, of every kind, and what tests do to them."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.compare.claims import Claims
from pipeline.compare.comparison import compare
from pipeline.compare.model import Comparison, Row, load_tolerances
from pipeline.storage.logs import Log, Series, read_log, write_log
from tests.project import ROOT

RESULTS = Path("data/results/example1")
LOG = RESULTS / "fit.mcap"
TOLERANCES = load_tolerances(ROOT / "tolerances.yaml")
CLAIMS = Claims.model_validate(
    {
        "claims": [
            {
                "claim": "the state keeps its bounds",
                "source": "Fig. 5",
                "value": {"file": "example1/metrics.json", "path": "sound.worst_state_margin_at_steps"},
                "at_least": 0,
            },
            {
                "claim": "bounds are there from 81 on",
                "source": "text",
                "value": {
                    "file": "example1/iterations.csv",
                    "column": "k_bar",
                    "where": {"bound": {}},
                    "pick": "first",
                },
                "equals": 81,
            },
            {
                "claim": "its largest value",
                "source": "Fig. 5",
                "value": {
                    "file": "example1/fit.mcap",
                    "topic": "/references/sound",
                    "column": "mean",
                    "pick": "largest",
                },
                "equals": 0.9,
                "within": 1e-3,
            },
        ]
    }
)
METRICS = {
    "sound": {
        "nlml": -3.7160332,
        "final_step": 130,
        "worst_state_margin_at_steps": 2.05e-9,
        "seconds": 1.5,
        "first": None,
        "said": "at 0.2812170167227962 s",
    }
}
SIGNAL = {
    "kernel": {"type": "squared_exponential", "lengthscale": 0.2},
    "mean": 0.0,
    "centres": [0.0],
    "weights": [1.5],
}
REFERENCE = {"signals": [SIGNAL], "plant": {"state_set": {"lower": [-2.0, -1.0], "upper": [0.05, 1.0]}}}
CERTIFICATE = {
    "format": "trackably certificate",
    "version": 3,
    "claim": {"kind": "all_times", "covers": {"x": {"ends": [0.0, 1.0], "radii": [0.5]}}},
    "reference": REFERENCE,
}
LEARNED = {"method": "sound", "reference": REFERENCE}
TABLE = "k_bar,bound\n80,\n81,0.7\n82,0.5\n83,0.4\n"
FIGURE = """<?xml version="1.0" encoding="utf-8"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 504 280.8">
 <defs><path id="m0772998e1b" d="M 0 0 L 0 3" style="stroke: #000000; stroke-width: 0.6"/></defs>
 <g id="axes_1">
  <g id="line2d_1"><path d="M 1 1 L 2 2 L 3 1 L 4 2" style="fill: none; stroke: #d55e00; stroke-width: 1.3"/></g>
  <use xlink:href="#m0772998e1b" x="46.3" y="122.2"/>
  <g id="text_1"><!-- step $k$ --></g>
  <g id="text_2"><!-- worst NUMBER --><g><defs/>OUTLINES</g></g>
 </g>
</svg>
"""


def figure(number: str = "4.480001") -> str:
    """Return a figure with a number, each of whose digits has an outline of its own."""
    outlines = "".join(f'<use xlink:href="#DejaVuSans-{ord(digit):x}"/>' for digit in number)
    return FIGURE.replace("NUMBER", number).replace("OUTLINES", outlines)


NOTEBOOK: dict[str, Any] = {
    "nbformat": 4,
    "nbformat_minor": 5,
    "metadata": {},
    "cells": [
        {"cell_type": "markdown", "id": "cell-0", "metadata": {}, "source": ["# Example\n", "Prose"]},
        {
            "cell_type": "code",
            "id": "cell-1",
            "metadata": {},
            "execution_count": 1,
            "source": ["table"],
            "outputs": [
                {"output_type": "stream", "name": "stdout", "text": ["learned\n", "theta 0.659325 of 7 samples\n"]},
                {"output_type": "stream", "name": "stdout", "text": ["theorem of 7 samples, checked by Coq"]},
                {"output_type": "execute_result", "metadata": {}, "data": {"text/plain": ["Table"]}},
            ],
        },
    ],
}


def build(root: Path) -> Path:
    """The project in a new folder."""
    results = root / "data/results/example1"
    (results / "figures").mkdir(parents=True)
    (root / "notebooks").mkdir()
    write(results / "metrics.json", METRICS)
    (results / "certificates").mkdir()
    write(results / "certificates/sound.json", CERTIFICATE)
    (results / "iterations.csv").write_text(TABLE)
    (results / "figures/margins.svg").write_text(figure())
    write(root / "notebooks/example1.ipynb", NOTEBOOK)
    times = np.arange(10) / 100
    mean = Series("/references/sound", times, {"mean": times * 10, "std": np.full(10, 0.1)})
    samples = Series("/samples", times, {"value": np.sin(times)})
    about = {"experiment": {"name": "example1", "written_by": "fit"}}
    write_log(root / LOG, Log((mean, samples), about, {"sound.json": json.dumps(LEARNED).encode()}))
    return root


def write(path: Path, content: object) -> None:
    path.write_text(json.dumps(content, indent=1))


Plant = Callable[[Path], object]
"""A change in the project in a folder."""


def edit_json(path: Path, change: Callable[[Any], object]) -> Plant:
    def plant(root: Path) -> None:
        content = json.loads((root / path).read_text())
        change(content)
        write(root / path, content)

    return plant


def metric(**values: object) -> Plant:
    return edit_json(RESULTS / "metrics.json", lambda metrics: metrics["sound"].update(values))


def edit_text(path: Path, old: str, new: str) -> Plant:
    def plant(root: Path) -> None:
        text = (root / path).read_text()
        assert old in text
        (root / path).write_text(text.replace(old, new))

    return plant


def edit_log(change: Callable[[Series], Series | None]) -> Plant:
    """Each series replaced by what `change` makes of it, or dropped."""

    def plant(root: Path) -> None:
        log = read_log(root / LOG)
        write_log(root / LOG, replace(log, series=tuple(new for series in log.series if (new := change(series)))))

    return plant


def compared(base: Path, new: Path) -> Comparison:
    return compare(base, new, TOLERANCES, CLAIMS, "BASE", "NEW")


def moved(comparison: Comparison) -> list[Row]:
    """The rows that are neither identical nor within tolerance."""
    return [row for row in comparison.rows if row.status.value not in {"identical", "within tolerance"}]


def only(comparison: Comparison) -> Row:
    """The one row that moved."""
    rows = moved(comparison)
    assert len(rows) == 1, [row.name for row in rows]
    assert not comparison.within
    return rows[0]
