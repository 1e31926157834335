"""The library's face: every public name is there, has its type, and loads no more than it needs."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import trackably
from tests.project import ROOT

USER = Path(__file__).parent / "user.py"


def test_what_is_public_is_there():
    assert sorted(trackably.__all__) == dir(trackably)
    for name in dir(trackably):
        assert getattr(trackably, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = trackably.nothing


def test_a_users_program_uses_all_that_is_public():
    """`make lint` checks its types by mypy --strict, without the project's own settings: marked mistakes are found."""
    used = {name for node in ast.walk(ast.parse(USER.read_text())) if isinstance(node, ast.ImportFrom)
            and node.module == "trackably" for name in (alias.name for alias in node.names)}  # fmt: skip
    assert used == {*trackably.__all__}


HEAVY = ("matplotlib", "cvxpy", "dvc", "mcap", "pydantic")
LOADED = {
    "check": (*HEAVY, "click", "IPython", "scipy", "flint"),
    "SquaredExponential": (*HEAVY, "scipy.linalg", "flint"),
    "read_csv": (*HEAVY, "click", "IPython", "scipy.optimize", "flint"),
    "learn_reference": (*HEAVY, "click", "IPython", "scipy.linalg", "scipy.optimize", "scipy.fft", "tqdm"),
}
"""What must not be loaded by a name, nor by those before it."""


def test_importing_is_light():
    """Neither figures nor convex programs nor data versions are loaded for a reference."""
    code = f"import sys, trackably\nfor name, heavy in {LOADED}.items():\n    getattr(trackably, name)\n"
    code += "    print(name, [m for m in heavy if m in sys.modules])"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "".join(f"{name} []\n" for name in LOADED)
