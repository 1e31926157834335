"""Notebooks as the pipeline executes them."""

from importlib import import_module
from pathlib import Path

import pytest

THREADS = """
import numpy as np
from threadpoolctl import threadpool_info

print({library["num_threads"] for library in threadpool_info()})
"""


def test_a_kernel_has_one_thread_for_linear_algebra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the last digits of what a notebook computes depend on how many cores a machine has."""
    # Loaded here, as its parsers take a second in each process that collects the tests.
    nbformat, pipeline = import_module("nbformat"), import_module("pipeline.notebook")
    monkeypatch.chdir(tmp_path)
    pipeline.NOTEBOOKS.mkdir()
    cells = [nbformat.v4.new_code_cell(THREADS)]
    nbformat.write(nbformat.v4.new_notebook(cells=cells), pipeline.NOTEBOOKS / "example1.ipynb")
    pipeline.notebook("example1")
    (cell,) = nbformat.read(pipeline.NOTEBOOKS / "example1.ipynb", as_version=4).cells
    assert cell.outputs[0].text == "{1}\n"
