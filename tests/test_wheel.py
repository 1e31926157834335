"""What `pip install .` brings: the library alone, and nothing that only the staged scripts need."""

import re
import subprocess
import sys
import tomllib
from email import message_from_bytes
from email.message import Message
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.imports import COMPUTED, imported, roots
from tests.project import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CALLED = {  # names of distributions, where modules are called otherwise
    "flint": "python-flint",
    "google": "protobuf",
    "mcap_protobuf": "mcap-protobuf-support",
    "mcap_ros2": "mcap-ros2-support",
    "PIL": "pillow",
    "ruamel": "ruamel.yaml",
}
PARTS = {"docutils": "sphinx", "pydantic_core": "pydantic", "traitlets": "nbclient"}  # of a package that is named
# cvxpy loads its solver; Jupyter is a command, and Sphinx's configuration names its extensions and theme.
BY_NAME_ONLY = {"clarabel", "jupyter", "myst-nb", "furo"}
# what the library imports only where it is asked for
OF_EXTRAS = {"distributed": "cluster", "pyarrow": "parquet", "ruamel.yaml": "pipeline"}


def required(requirements: list[str]) -> set[str]:
    return {re.split(r"[<>=!~;\[ ]", requirement)[0] for requirement in requirements}


def used_by(package: str) -> set[str]:
    found = roots(imported(ROOT / package)) - {*sys.stdlib_module_names, "trackably", "pipeline", COMPUTED}
    return {CALLED.get(name, PARTS.get(name, name)) for name in found}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return ZipFile(path)


@pytest.fixture(scope="module")
def metadata(wheel: ZipFile) -> Message:
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    return message_from_bytes(wheel.read(name))


def test_the_wheel_holds_the_library_and_nothing_else(wheel: ZipFile) -> None:
    shipped = {name for name in wheel.namelist() if ".dist-info/" not in name}
    tracked = {path.relative_to(ROOT).as_posix() for path in (ROOT / "trackably").rglob("*.py")}
    assert {name for name in shipped if name.endswith(".py")} == tracked
    assert all(Path(name).parts[0] == "trackably" for name in shipped)
    assert "trackably/exports/trackably.mplstyle" in shipped


def test_without_an_extra_it_requires_what_the_library_imports(metadata: Message) -> None:
    every = metadata.get_all("Requires-Dist", [])
    plain = required([requirement for requirement in every if "extra ==" not in requirement])
    assert plain == (used_by("trackably") - OF_EXTRAS.keys()) | {"clarabel"} == required(PROJECT["dependencies"])
    assert not plain & {"dvc", "jupyter", "pydantic", "click", "nbclient", "nbformat"}
    assert {*metadata.get_all("Provides-Extra", [])} == {"pipeline", *OF_EXTRAS.values()}
    for package, extra in OF_EXTRAS.items():
        assert package in required(PROJECT["optional-dependencies"][extra])


def test_the_extra_has_what_the_stages_import_beside_it() -> None:
    extra, library = required(PROJECT["optional-dependencies"]["pipeline"]), required(PROJECT["dependencies"])
    assert not extra & library
    assert used_by("pipeline") - library == extra - BY_NAME_ONLY - OF_EXTRAS.keys()


def test_everything_required_is_pinned_with_hashes_and_without_hosts() -> None:
    for lock in ("requirements.lock", "requirements-bench.lock"):
        assert "://" not in (ROOT / lock).read_text(encoding="utf-8")
    text = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    pinned = {match[1].replace("-", "_"): match[2] for match in re.finditer(r"^(\S+?)==(.*(?:\n    .*)*)", text, re.M)}
    wanted = required(PROJECT["dependencies"]) | required(PROJECT["optional-dependencies"]["pipeline"])
    for name in wanted:
        assert "--hash=sha256:" in pinned[name.replace("-", "_").replace(".", "_")], name
