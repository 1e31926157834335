"""Notebooks as the pipeline executes them."""

from base64 import b64decode, b64encode
from io import BytesIO
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_notebook
from PIL import Image

from pipeline.notebook import NOTEBOOKS, _smaller, notebook

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


def test_pictures_lose_bytes_and_no_colour_that_anybody_sees() -> None:
    x, y = np.meshgrid(np.linspace(0, 255, 300), np.linspace(0, 255, 200))
    waves = 127.5 + 127.5 * np.sin(x / 9) * np.cos(y / 7)
    pixels = np.stack([x, y, waves, np.full_like(x, 255)], axis=-1)
    before = BytesIO()
    Image.fromarray(pixels.astype(np.uint8)).save(before, "PNG")
    after = b64decode(_smaller(b64encode(before.getvalue()).decode()))
    assert len(after) < 0.5 * len(before.getvalue())
    seen = np.asarray(Image.open(BytesIO(after)).convert("RGB"), dtype=int)
    assert np.max(np.abs(seen - pixels.astype(np.uint8)[..., :3])) <= 7
    assert (seen[0, 0, 0], seen[-1, -1, 0]) == (0, 255)
