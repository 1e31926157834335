"""Notebooks as the pipeline executes them."""

from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_notebook

from pipeline.notebook import NOTEBOOKS, notebook

THREADS = """
import numpy as np
from threadpoolctl import threadpool_info

print({library["num_threads"] for library in threadpool_info()})
"""


def test_a_kernel_has_one_thread_for_linear_algebra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the last digits of what a notebook computes depend on how many cores a machine has."""
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "2")
    monkeypatch.chdir(tmp_path)
    NOTEBOOKS.mkdir()
    nbformat.write(new_notebook(cells=[new_code_cell(THREADS)]), NOTEBOOKS / "example1.ipynb")
    notebook("example1")
    (cell,) = nbformat.read(NOTEBOOKS / "example1.ipynb", as_version=4).cells
    assert cell.outputs[0].text == "{1}\n"
